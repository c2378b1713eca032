"""Errors of the characterisation that a user can cause."""

from bifa.errors import BifaError


class TooLittleDataError(BifaError):
    """A parameter cannot be had from this data set; the text says which, and which experiment gives it."""
