"""A trial in which the robot was stopped, or did anything but what was asked, is no data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from bifa.errors import BifaError
from bifa.link import Sample
from bifa.link.table import CHAMBERS

_CONNECTED = {0.0: "vacuum", 1.0: "positive"}


class DisturbedError(BifaError):
    """The robot left what it was to do in the middle of a trial."""


def refuse_disturbed(samples: Sequence[Sample], state: str, held: Mapping[str, str] | None = None) -> None:
    """Raise DisturbedError unless the robot was in `state` in all of `samples`, its valves as it was commanded.

    held: what each chamber is connected to in all of them; None where commands change. A chamber that is switched is
    vented for a few milliseconds first, which one sample may see.
    """
    if not samples:
        raise DisturbedError("the Uno sent no sample in that state: was it stopped at once?")
    begun_s = samples[0].time_us * 1e-6
    before = samples[0]
    for sample in samples:
        if wrong := _wrong(before, sample, state, held):
            after_s = sample.time_us * 1e-6 - begun_s
            raise DisturbedError(f"{after_s:.2f} s after it began {wrong}: that is no trial; repeat it")
        before = sample


def _wrong(before: Sample, sample: Sample, state: str, held: Mapping[str, str] | None) -> str:
    """What is not as it should be, in words; empty where all is."""
    if sample.state != state:
        return f"the robot was {sample.state} instead of {state}"
    for i, chamber in enumerate(CHAMBERS):
        wanted = _CONNECTED.get(sample.command[i], "off")
        if held is not None and wanted != held.get(chamber, "off"):
            return f"the {chamber} was commanded to {wanted} instead of {held.get(chamber, 'off')}"
        is_switched = not _same(before.command[i], sample.command[i])
        if sample.connected[i] != wanted and not (is_switched and sample.connected[i] == "off"):
            return f"the valves connected the {chamber} to {sample.connected[i]} instead of {wanted}"
    return ""


def _same(a: float, b: float) -> bool:
    return a == b or (math.isnan(a) and math.isnan(b))
