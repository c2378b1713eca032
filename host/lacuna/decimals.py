"""Parsing of numbers in text files: plain decimals, as instruments write them, and nothing else."""

import re

DECIMAL = re.compile(r"([+-]?)[ \t]*((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)", re.ASCII)
BLANKS = " \t"
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE | re.ASCII)


def decimal(cell: str) -> float | None:
    """Return the number in a cell, or None if it holds anything else. Stricter than Python's float, which reads 1_5 as
    15 and accepts full-width and Arabic digits; but data loggers pad numbers between sign and digits."""
    found = DECIMAL.fullmatch(cell.strip(BLANKS))
    return float(found[1] + found[2]) if found else None


def number(cell: str) -> float | None:
    """As `decimal`, but also accept the words that numpy and pandas write for non-finite values."""
    word = cell.strip(BLANKS)
    return float(word) if _NOT_FINITE.fullmatch(word) else decimal(cell)
