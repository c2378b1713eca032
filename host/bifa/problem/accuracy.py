"""The accuracy that the user needs, for each measured quantity."""

import math
from collections.abc import Iterable, Mapping

from bifa.errors import BifaError

QUANTITIES = ("displacement_mm", "pressure_psi", "force_N")


class AccuracyError(BifaError):
    """An accuracy is not of the form QUANTITY=VALUE; the text lists the quantities."""


def accuracies(texts: Iterable[str]) -> dict[str, float]:
    """Parse RMS errors by quantity from texts such as "displacement_mm=0.5". Raises AccuracyError."""
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if name not in QUANTITIES or not (math.isfinite(number) and number > 0.0):
            raise AccuracyError(
                f"--matters {text!r}: give a quantity ({', '.join(QUANTITIES)}) and the RMS error that is good enough,"
                " as in --matters displacement_mm=0.5"
            )
        found[name] = number
    return found


def accuracy_of(channel: str, accuracies: Mapping[str, float]) -> float:
    """The accuracy of a channel (displacement_head_mm is a displacement_mm); 0, only noise counts, if none is given."""
    return next((v for q, v in accuracies.items() if is_of(channel, q)), 0.0)


def is_of(channel: str, quantity: str) -> bool:
    """Whether a channel measures a quantity."""
    first, unit = quantity.rsplit("_", 1)
    return channel.startswith(first) and channel.endswith(unit)
