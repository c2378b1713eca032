"""Errors meant for the user: the message says what is wrong and what to do."""

from collections.abc import Iterable
from typing import Any


class LacunaError(Exception):
    """An error meant for the user: a sentence to be shown without a traceback."""

    for_the_user = True


class MisuseError(LacunaError):
    """The system, its records or an argument is unsuitable for a diagnosis; the message says where and what to do."""


class TooLittleDataError(MisuseError):
    """There are too few data to fit, or to judge a fit."""


class DeclarationError(LacunaError, ValueError):
    """The declaration of a system is invalid; the message says where."""


def listed(names: Iterable[Any], most: int = 4) -> str:
    """Join the first `most` names, and say how many more there are."""
    every = [str(name) for name in names]
    more = f" and {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + more
