# SPDX-License-Identifier: GPL-3.0-or-later
"""The lab's instruments, each with its own clock: motion capture, testing machine, anchor-pull rig."""

from virtual_robot.instruments.bench import Instruments
from virtual_robot.instruments.sensors import Noise

__all__ = ["Instruments", "Noise"]
