"""Summary of the measured records, and the origin of the noise floor in words."""

from __future__ import annotations

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.system import by_channel


def measured_rows(diagnosis: Diagnosis) -> list[tuple[str, str, str, str, str]]:
    """Table rows by experiment and channel: records and conditions, floor, samples per observation, and its basis."""
    rows = []
    for (experiment, channel), trials in by_channel(diagnosis.base.structure.system.trials).items():
        noise = diagnosis.search.floor.of(experiment, channel)
        conditions = len({t.condition for t in trials})
        basis = _pairs(noise.repeats) if noise.repeats else "the fast noise of the residual"
        piece = f"{noise.samples_per_piece:.3g}"
        sd = f"{noise.sd:.3g}" + (f" at {noise.reading:.3g}, and grows with the reading" if noise.grows else "")
        rows.append((f"{experiment}: {channel}", f"{len(trials)} in {conditions}", sd, piece, basis))
    return rows


def floor_sentence(diagnosis: Diagnosis) -> str:
    """Say where the floor comes from and, for channels without repeats, what that implies."""
    channels = diagnosis.search.floor.channels
    repeats = sum(noise.repeats for noise in channels.values())
    alone = sorted({channel for (_, channel), noise in channels.items() if not noise.repeats})
    if not alone:
        return f"The floor comes from the differences between {_pairs(repeats)}."
    time_s = diagnosis.base.structure.system.noise_time_s
    told = {c: seconds for c in alone if (seconds := max(time_s(*key) for key in channels if key[1] == c))}
    if len(told) == len(alone):
        listed = ", ".join(f"{seconds:.3g} s of {channel}" for channel, seconds in told.items())
        return (
            f"Without repeats the floor is how much residuals change within the noise's correlation time ({listed});"
            " whatever varies that fast counts as noise here, whatever is slower as structure."
        )
    return (
        f"Without repeats the floor of {', '.join(alone)} is the fast noise of the residual: whatever varies slowly"
        " from run to run counts as structure here, and only a repeat could show that it is not."
    )


def _pairs(count: int) -> str:
    return "one pair of repeats" if count == 1 else f"{count} pairs of repeats"
