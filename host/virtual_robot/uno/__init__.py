# SPDX-License-Identifier: GPL-3.0-or-later
"""An Arduino Uno in virtual time: the real image in libsimavr, corrected where libsimavr 1.6 is wrong."""

from virtual_robot.uno.board import CLOCK_HZ, Event, Uno

__all__ = ["CLOCK_HZ", "Event", "Uno"]
