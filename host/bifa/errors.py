"""Base class of all errors that bifa anticipates; their texts say what is wrong and what to do."""

import numbers

from bifa.printable import printable


class BifaError(Exception):
    """Shown to the user as one sentence, without a traceback; exit status 2. Its text is safe to show (printable)."""

    def __str__(self) -> str:
        return printable(super().__str__())


def check_range(error: type[BifaError], name: str, value: float, lower: float, upper: float, unit: str = "") -> None:
    """Raise `error`, naming the range, unless `value` is a finite number within it."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):  # NumPy's numbers are Real, too
        raise error(f"{name} = {value!r} is not a number")
    if not lower <= value <= upper:  # also refuses NaN, and integers too large for a float
        raise error(f"{name} = {value} is outside its range {lower:g} to {upper:g} {unit}".rstrip())
