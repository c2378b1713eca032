"""Reject trials in which the robot was stopped or did anything other than what was commanded."""

from collections.abc import Mapping, Sequence

from bifa.errors import BifaError
from bifa.link import Sample
from bifa.ranges import CHAMBERS

_CONNECTED = {0.0: "vacuum", 1.0: "positive"}
_SUPPLIES = set(_CONNECTED.values())
_LATE_US = 27_000  # a supply is held for at least 21 ms and the chamber then vented for 5 (lib/valves/sequencer.h)
_SAMPLES = 3  # samples in that time


class DisturbedError(BifaError):
    """The robot did something other than commanded during a trial."""


def refuse_disturbed(samples: Sequence[Sample], state: str, held: Mapping[str, str] | None = None) -> None:
    """Raise DisturbedError unless the robot was in `state` in all of `samples`, with its valves as commanded.

    held: what each chamber is connected to throughout; None if commands change. A chamber that is switched is first
    vented for a few milliseconds; if it was switched just before, as may happen at the start of a gait, it first keeps
    its former supply for a while. A gait's very first switches may precede the first sample.
    """
    if not samples:
        raise DisturbedError("the Uno sent no sample in that state: was it stopped at once?")
    for k, sample in enumerate(samples):
        before = [one for one in samples[max(k - _SAMPLES, 0) : k] if sample.time_us - one.time_us <= _LATE_US]
        after_us = sample.time_us - samples[0].time_us
        unseen = _SUPPLIES if held is None and after_us <= _LATE_US else set()
        if wrong := _describe_fault(before, unseen, sample, state, held):
            raise DisturbedError(f"{1e-6 * after_us:.2f} s after it began, {wrong}: the trial is not valid; repeat it")


def _describe_fault(
    before: Sequence[Sample], unseen: set[str], sample: Sample, state: str, held: Mapping[str, str] | None
) -> str:
    """Describe what is wrong with a sample, given the samples just `before` and commands that may have been `unseen`;
    empty if nothing is."""
    if sample.state != state:
        return f"the robot was {sample.state} instead of {state}"
    for i, chamber in enumerate(CHAMBERS):
        wanted = _CONNECTED.get(sample.command[i], "off")
        if held is not None and wanted != held.get(chamber, "off"):
            return f"the {chamber} was commanded to {wanted} instead of {held.get(chamber, 'off')}"
        lately = ({_CONNECTED.get(one.command[i], "off") for one in before} | unseen) - {wanted}
        is_late = wanted != "off" and lately and sample.connected[i] in {"off", *lately}  # it vents at once
        if sample.connected[i] != wanted and not is_late:
            return f"the valves connected the {chamber} to {sample.connected[i]} instead of {wanted}"
    return ""
