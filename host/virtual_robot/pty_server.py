# SPDX-License-Identifier: GPL-3.0-or-later
"""Serve the bench on a pseudo-terminal in real time, for people and for any serial program.

Opening the port of a real Uno resets it through DTR, a line that a pty does not have. So the board is reset when the
pty is opened, which is when the kernel stops reporting the other side as hung up.
"""

import contextlib
import os
import select
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from virtual_robot.errors import VirtualRobotError, check_place

_SLICE_S = 0.005
_STATUS_S = 0.25
_BOOTLOADER_S = 0.5
_MAX_LAG_S = 0.5  # after a longer stall (a suspended process) lost time is not made up


def serve(
    rig: Any,
    on_ready: Callable[[str], None],
    on_status: Callable[[dict[str, Any]], None] = lambda status: None,
    link: Path | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> None:
    """Serve the bench on a pty in real time until `stop()` or KeyboardInterrupt. `on_ready` gets the pty's path,
    `on_status` a dict four times a second; `link` is a symbolic link to the pty, removed at the end."""
    if not hasattr(os, "openpty"):
        raise VirtualRobotError("a pseudo-terminal needs Linux or macOS")
    import tty  # not available on Windows

    if link is not None:
        _check_link(link)
    master, slave = os.openpty()
    tty.setraw(slave)
    path = os.ttyname(slave)
    os.close(slave)  # so that the kernel reports whether somebody has it open
    os.set_blocking(master, False)
    try:
        if link is not None:
            _point(link, path)
        on_ready(path)
        _Pump(rig, master).run(on_status, stop)
    finally:
        os.close(master)
        if link is not None and link.is_symlink() and os.readlink(link) == path:
            link.unlink()


def _check_link(link: Path) -> None:
    if link.exists() and not link.is_symlink():
        raise VirtualRobotError(f"{link} exists and is not a symbolic link; choose another name for the link")
    if link.exists():  # a link that a killed rig has left points nowhere, or to a terminal of somebody else
        raise VirtualRobotError(
            f"{link} leads to {os.readlink(link)}, perhaps of another rig: end that one, choose another name for the "
            "link, or remove it"
        )
    check_place(link, "the link")


def _point(link: Path, path: str) -> None:
    temporary = link.with_name(f".{link.name}.{os.getpid()}")
    temporary.symlink_to(path)
    os.replace(temporary, link)


class _Pump:
    """Moves bytes between pty and board and keeps virtual time in step with the wall clock."""

    def __init__(self, rig: Any, master: int) -> None:
        self._rig = rig
        self._master = master
        self._poll = select.poll()
        self._poll.register(master, select.POLLIN)
        self._is_open = False
        self._unsent = b""

    def run(self, on_status: Callable[[dict[str, Any]], None], stop: Callable[[], bool]) -> None:
        world = self._rig.world
        wall_start, virtual_start = time.monotonic(), world.now()
        next_status = 0.0
        while not stop():
            wall = time.monotonic() - wall_start
            behind = wall - (world.now() - virtual_start)
            if behind > _MAX_LAG_S:
                wall_start, wall, behind = wall_start + behind, wall - behind, _SLICE_S
            if behind > 0:
                world.run(min(behind, 4 * _SLICE_S))
            self._to_host()
            if wall >= next_status:
                next_status = wall + _STATUS_S
                on_status(self._status())
            self._from_host(0 if behind > 4 * _SLICE_S else _SLICE_S)

    def _from_host(self, timeout_s: float) -> None:
        events = self._poll.poll(timeout_s * 1e3)
        flags = events[0][1] if events else 0
        is_open = not flags & select.POLLHUP
        if is_open and not self._is_open:
            # The bootloader's time lets the host flush its buffers first, as with a real board.
            self._rig.uno.reset("external", bootloader_s=_BOOTLOADER_S)
            self._rig.uno.receive()
            self._unsent = b""
        self._is_open = is_open
        if flags & select.POLLIN:  # also what was written before a hang-up: a real port sends it out
            with contextlib.suppress(BlockingIOError, OSError):
                self._rig.uno.send(os.read(self._master, 4096))
        elif not is_open:
            time.sleep(timeout_s)  # poll returns at once while nobody is there

    def _to_host(self) -> None:
        self._unsent += self._rig.uno.receive()
        if not self._is_open:
            self._unsent = b""
        while self._unsent:
            try:
                sent = os.write(self._master, self._unsent[:1024])
            except (BlockingIOError, OSError):
                self._unsent = self._unsent[-4096:]  # nobody reads: a real port would lose bytes as well
                return
            self._unsent = self._unsent[sent:]

    def _status(self) -> dict[str, Any]:
        rig = self._rig
        sample = rig.plant.sample(rig.world.now() - rig.instruments.mounted_s)
        return {
            "time_s": rig.world.now(),
            "open": self._is_open,
            "displacement_mm": 1e3 * float(sample["head_m"]),
            "pressure_psi": [float(p) for p in sample["pressure_psi"]],
            "connected": [int(c) for c in sample["connected"]],
            "resets": rig.uno.resets,
            "asleep": rig.uno.asleep_s / max(rig.uno.time_s, 1e-9),
        }
