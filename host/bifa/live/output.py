"""Output that cannot be written, as on a full disk, ends a command with a sentence that says so."""

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from bifa.errors import BifaError

_FULL = tuple(getattr(errno, name) for name in ("ENOSPC", "EFBIG", "EDQUOT") if hasattr(errno, name))


class OutputError(BifaError):
    """What a command prints cannot be written; the text says why."""


@contextmanager
def writable() -> Iterator[None]:
    """Wraps a whole command: an error of a full disk becomes an OutputError. A robot inside has been stopped by
    then."""
    try:
        yield
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError as error:
        if error.errno is None or error.errno not in _FULL:
            raise
        with contextlib.suppress(OSError, ValueError):  # what is not written yet would fail once more as Python exits
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, sys.stdout.fileno())
            os.close(nowhere)
        what = error.filename2 or error.filename or "the output"  # of a copy the second is where it goes
        reason = os.strerror(error.errno)
        raise OutputError(f"{what} cannot be written ({reason}); free some space, or redirect it") from None
