# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of the virtual bench, whose messages say what to do, and a check that a file can be written."""

import os
from pathlib import Path


class VirtualRobotError(Exception):
    """Base class of the errors that the virtual bench expects."""

    for_the_user = True  # the message is complete: a host that does not know this class may show it alone


class NotBuiltError(VirtualRobotError):
    """A C part has not been compiled."""

    def __init__(self, part: str) -> None:
        super().__init__(
            f"the virtual robot's {part} is not compiled: run `python -m virtual_robot.build`"
            + (" (needs libsimavr-dev and libelf-dev)" if part == "uno" else " (needs a C compiler)")
        )


class FirmwareError(VirtualRobotError):
    """There is no image to run."""

    def __init__(self, path: object, why: str = "not found") -> None:
        super().__init__(f"firmware image {path}: {why}; build it with `pio run -e uno`")


class EventsGoneError(VirtualRobotError):
    """The event log no longer holds the requested event."""

    def __init__(self, first: int) -> None:
        super().__init__(
            f"event {first} is no longer in the log, which keeps the last half million; read the log more often"
        )


class PortClosedError(ConnectionError):
    """The simulated serial port is no longer there (closed, or the board has no power)."""


def check_place(file: Path, what: str) -> None:
    """Raise VirtualRobotError unless the folder of `file` is writable; `what` names the file in the message."""
    folder = file.absolute().parent
    if not folder.is_dir():
        raise VirtualRobotError(f"the folder of {what} {file} does not exist; create it first")
    if not os.access(folder, os.W_OK):
        raise VirtualRobotError(f"{what} {file} cannot be written (no permission); choose another place")
