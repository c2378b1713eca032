"""Errors of the characterisation that a user can cause."""

from bifa.errors import BifaError


class TooLittleDataError(BifaError):
    """A parameter cannot be determined from this data set; the text says which, and which experiment would do it."""
