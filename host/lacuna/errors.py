"""Errors that the engine expects: their text says what is wrong and what to do."""

from collections.abc import Iterable
from typing import Any


class LacunaError(Exception):
    """An error meant for the user: one sentence, to be shown without a traceback."""

    for_the_user = True


class MisuseError(LacunaError):
    """The system or its records are not what a diagnosis needs; the text says where and what to do."""


class TooLittleDataError(MisuseError):
    """There is nothing to fit, or nothing to judge a fit by."""


class DeclarationError(LacunaError, ValueError):
    """The declaration of a system contradicts itself; the text says where."""


def listed(names: Iterable[Any], most: int = 4) -> str:
    """The first few, and how many more there are."""
    every = [str(name) for name in names]
    more = f" and {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + more
