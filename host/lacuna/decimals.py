"""The one rule for numbers in text files: plain decimals, as every instrument writes them and nothing else."""

from __future__ import annotations

import re

DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
BLANKS = " \t"
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE | re.ASCII)


def decimal(cell: str) -> float | None:
    """The number in a cell; None where it is anything else. Python's float would read 1_5 as 15, and full-width or
    Arabic digits as numbers."""
    cell = cell.strip(BLANKS)
    return float(cell) if DECIMAL.fullmatch(cell) else None


def number(cell: str) -> float | None:
    """As `decimal`, with the words that numpy and pandas write for what is not finite."""
    word = cell.strip(BLANKS)
    return float(word) if _NOT_FINITE.fullmatch(word) else decimal(cell)
