"""What a rig's instruments are asked: the protocol that a virtual bench, a lab's drivers and a person answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeGuard

import numpy as np


class Instruments(Protocol):
    """The stand and what measures on it, as `rig.instruments`.

    Experiments and their settings: static_loading(actuator, rate_mm_s), step_response(actuator),
    anchor_pull(rate_mm_s, travel_mm), locomotion(inclination_deg); actuator is "large" or "small".
    """

    def mount(self, experiment: str, **settings: Any) -> None:
        """Put `experiment` on the stand: vented, contracted, at rest, displacement 0."""

    def start(self) -> None:
        """Begin a record. Within 0.1 s of the return the sync input has to see strobes."""

    def move(self) -> None:
        """Set the cross-head in motion (static_loading: to the extended state and back; anchor_pull: the pull)."""

    @property
    def moving(self) -> bool:
        """Whether the cross-head is under way."""

    def stop(self) -> dict[str, np.ndarray]:
        """End the record: arrays of `time_s`, of the channels of `CHANNELS` (and of `displacement_tail_mm` where it was
        tracked), each of shape (samples,), and `sync_time_s` (edges,), all by the instrument's own clock."""


class AskedInstruments(Instruments, Protocol):
    """Instruments that a person, or a slow machine, works: what is asked of them is done once `ready`."""

    @property
    def ready(self) -> bool:
        """Whether what was asked last (mount, start, save) has been done."""

    def attend(self) -> None:
        """Called while nothing is asked of them: KeyboardInterrupt where somebody has asked to stop. Optional."""

    def tell(self, what: str, left_s: float) -> None:
        """Called every quarter of a second while nothing is asked of them: what the robot does now, and for how long
        still, s. Optional."""

    def save(self) -> None:
        """Ask for the record of the recording that has just ended; `stop` gives it once `ready`."""


CHANNELS = {
    "static_loading": ("displacement_mm", "force_N"),
    "anchor_pull": ("displacement_mm", "force_N"),
    "step_response": ("displacement_mm",),
    "locomotion": ("displacement_head_mm",),
}


def are_asked(instruments: Instruments) -> TypeGuard[AskedInstruments]:
    """Whether these are `AskedInstruments`."""
    return hasattr(instruments, "ready")


def until_ready(instruments: Instruments, wait: Callable[[], object]) -> None:
    """Call `wait` until what was asked of the instruments has been done; not at all where they do it at once."""
    while are_asked(instruments) and not instruments.ready:
        wait()


def attend(instruments: Instruments | None, doing: str = "", left_s: float = 0.0) -> None:
    """Let instruments that somebody works hear that person out, and tell what the robot is `doing` meanwhile."""
    listens, tell = (getattr(instruments, name, None) for name in ("attend", "tell"))
    if listens is not None:
        listens()
    if doing and tell is not None:
        tell(doing, left_s)
