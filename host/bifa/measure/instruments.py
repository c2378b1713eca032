"""The protocol of a rig's instruments, implemented by a virtual bench, a lab's drivers, or a person at the desk."""

from collections.abc import Callable
from typing import Any, Protocol, TypeGuard

import numpy as np


class Instruments(Protocol):
    """The test stand and its instruments, as `rig.instruments`.

    Experiments and their settings: static_loading(actuator, rate_mm_s), step_response(actuator),
    anchor_pull(rate_mm_s, travel_mm), locomotion(inclination_deg); actuator is "large" or "small".
    """

    def mount(self, experiment: str, **settings: Any) -> None:
        """Set up `experiment` on the stand: vented, contracted, at rest, displacement 0."""

    def start(self) -> None:
        """Begin a record. The sync input has to see strobes within 0.1 s after this returns."""

    def move(self) -> None:
        """Set the cross-head in motion (static_loading: to the extended state and back; anchor_pull: the pull)."""

    @property
    def moving(self) -> bool:
        """Whether the cross-head is moving."""

    def stop(self) -> dict[str, np.ndarray]:
        """End the record and return its arrays: `time_s` and the channels in `CHANNELS` (also `displacement_tail_mm` if
        it was tracked), each of shape (samples,), and `sync_time_s` (edges,), all times by the instrument's clock."""


class AskedInstruments(Instruments, Protocol):
    """Instruments operated by a person or a slow machine: a request has been carried out once `ready`."""

    @property
    def ready(self) -> bool:
        """Whether the last request (mount, start, move, save) has been carried out."""

    def attend(self) -> None:
        """Called while no request is pending. Raises KeyboardInterrupt if somebody has asked to stop. Optional."""

    def tell(self, what: str, left_s: float) -> None:
        """Called every quarter of a second while no request is pending, with what the robot is doing and for how much
        longer [s]. Optional."""

    def save(self) -> None:
        """Request the record of the recording that has just ended; `stop` returns it once `ready`."""


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
    """Call `wait` until the instruments' last request has been carried out; not at all if they act at once."""
    while are_asked(instruments) and not instruments.ready:
        wait()


def attend(instruments: Instruments | None, doing: str = "", left_s: float = 0.0) -> None:
    """Let `AskedInstruments` check for a stop by the person, and tell them what the robot is `doing` meanwhile."""
    listens, tell = (getattr(instruments, name, None) for name in ("attend", "tell"))
    if listens is not None:
        listens()
    if doing and tell is not None:
        tell(doing, left_s)
