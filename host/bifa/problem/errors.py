"""Errors of the characterisation that a user can cause."""

from bifa.errors import BifaError


class UndeterminedError(BifaError):
    """A parameter cannot be determined from this data set; the text says which, and which experiment would do it."""
