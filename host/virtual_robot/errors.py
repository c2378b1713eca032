# SPDX-License-Identifier: GPL-3.0-or-later
"""What can go wrong on the virtual bench, each saying what to do; and the check of a file's place, before the work."""

import os
from pathlib import Path


class VirtualRobotError(Exception):
    """The root of every error that the virtual bench expects."""

    for_the_user = True  # its text says all; a host that does not know this class may show it as it is


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
    """The log of events has dropped what was asked for."""

    def __init__(self, first: int) -> None:
        super().__init__(
            f"event {first} is no longer in the log, which keeps the last half a million: read it more often"
        )


class PortClosedError(ConnectionError):
    """The simulated serial port is no longer there (closed, or the board has no power)."""


def check_place(file: Path, what: str) -> None:
    """Before the work: raise VirtualRobotError unless the folder of `file`, called `what`, can be written in."""
    folder = file.absolute().parent
    if not folder.is_dir():
        raise VirtualRobotError(f"the folder of {what} {file} does not exist; create it first")
    if not os.access(folder, os.W_OK):
        raise VirtualRobotError(f"{what} {file} cannot be written (no permission); choose another place")
