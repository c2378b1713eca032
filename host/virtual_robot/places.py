# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a file can be made where it is asked for."""

import os
from pathlib import Path

from virtual_robot.errors import VirtualRobotError


def check_place(file: Path, what: str) -> None:
    """Before the work: raise VirtualRobotError unless the folder of `file`, called `what`, can be written in."""
    folder = file.absolute().parent
    if not folder.is_dir():
        raise VirtualRobotError(f"the folder of {what} {file} does not exist; create it first")
    if not os.access(folder, os.W_OK):
        raise VirtualRobotError(f"{what} {file} cannot be written (no permission); choose another place")
