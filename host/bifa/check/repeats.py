"""Repeats that differ so much from the others of their condition that something else must have been recorded.

The comparison does not depend on when a recording was started: forces are compared at equal displacement, steps and
walks from the first switch on. For walks only pressures and length count, since two runs of a brittle gait may end far
apart.

Also finds the same record in two trials, saved, named or copied twice: no two recordings have the same noise.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bifa.check.finding import Finding
from bifa.data import Dataset, Trial
from bifa.data.layout import is_command

# Limits of the RMS difference, as a share of a channel's range. Healthy: 0.08 at most, if areas drift or sensors warm.
_MAX_DIFFERENCE = 0.10
_MAX_PAIR_DIFFERENCE = 0.20  # for two repeats, which do not show which of them is wrong
_MAX_OTHERS_RATIO = 4.0  # in units of the others' difference from one another
# In units of the day's usual difference between repeats of this experiment: a lab's ordinary scatter.
_MAX_USUAL_RATIO = 5.0
_POINTS = 400
_LENGTH = "displacement_head_mm - displacement_tail_mm"

Curve = tuple[np.ndarray, np.ndarray]  # increasing abscissae, and the values there


@dataclass(frozen=True)
class _Group:
    """Repeats of a condition: `differences[channel]`, shape (n, n), their RMS differences as shares of
    `ranges[channel]`."""

    trials: Sequence[Trial]
    differences: dict[str, np.ndarray]
    ranges: dict[str, float]


def check_repeats(dataset: Dataset, skipped: Collection[str] = ()) -> Iterator[Finding]:
    """Yield a finding for each repeat unlike the others. `skipped`: files with a known mistake, left out."""
    kept = [[trial for trial in group if trial.file not in skipped] for group in dataset.repeats()]
    groups = [_compare(group) for group in kept if len(group) > 1]
    for group in groups:
        usual = _usual(group, groups)
        yield from _check_pair(group, usual) if len(group.trials) == 2 else _check_group(group, usual)


def check_copies(dataset: Dataset, skipped: Collection[str] = ()) -> Iterator[Finding]:
    """Yield a finding for each trial whose displacement or force equals that of an earlier trial of the same
    experiment. `skipped`: files with a known mistake, left out."""
    first: dict[tuple[str, str, bytes], str] = {}
    for trial in (trial for trial in dataset.trials if trial.file not in skipped):
        for name, values in trial.columns.items():
            if not name.startswith(("displacement", "force")) or np.ptp(values) == 0.0:
                continue
            earlier = first.setdefault((trial.experiment, name, values.tobytes()), trial.file)
            if earlier != trial.file:
                text = f"has the same {name} as {earlier}, sample by sample: insert its own record, or leave it out"
                yield Finding("copy", text, trial.file, column=name)
                break


def _check_group(group: _Group, usual: dict[str, float]) -> Iterator[Finding]:
    """Findings in groups of three and more. A repeat counts as different only if even the nearest other one is far
    away: if two of five agree with each other, neither is a mistake."""
    for place, trial in enumerate(group.trials):
        others = [k for k in range(len(group.trials)) if k != place]
        found = []
        for channel, differences in group.differences.items():
            alike = float(np.median([min(differences[k, j] for j in others if j != k) for k in others]))
            far = float(differences[place, others].min())
            if far > max(_MAX_DIFFERENCE, _MAX_OTHERS_RATIO * alike, _MAX_USUAL_RATIO * usual[channel]):
                found.append((far, alike, channel))
        if found:
            far, alike, channel = max(found)
            span, unit = group.ranges[channel], _unit(channel)
            text = (
                f"repeat {trial.repeat} of {trial.label} differs from the others by {far * span:.3g} {unit} (RMS), "
                f"which differ by {alike * span:.2g} {unit} from one another: was something else mounted or set? "
                "Record it again, or leave it out"
            )
            yield Finding("repeat", text, trial.file, column=channel)


def _check_pair(group: _Group, usual: dict[str, float]) -> Iterator[Finding]:
    one, other = group.trials
    found = [(float(differences[0, 1]), channel) for channel, differences in group.differences.items()]
    found = [
        (far, channel) for far, channel in found if far > max(_MAX_PAIR_DIFFERENCE, _MAX_USUAL_RATIO * usual[channel])
    ]
    if found:
        far, channel = max(found)
        text = (
            f"{one.file} and {other.file} differ by {far * group.ranges[channel]:.3g} {_unit(channel)} (RMS), "
            f"{100 * far:.0f} % of the range: one of these repeats was recorded differently; a third would tell which"
        )
        yield Finding("repeat", text, column=channel, files=(one.file, other.file))


def _usual(group: _Group, groups: Sequence[_Group]) -> dict[str, float]:
    """Median difference between repeats in the experiment's other conditions, by channel; 0 if there are none."""
    found: dict[str, list[float]] = {channel: [] for channel in group.differences}
    for other in groups:
        if other is not group and other.trials[0].experiment == group.trials[0].experiment:
            for channel in found.keys() & other.differences.keys():
                found[channel].extend(other.differences[channel][np.triu_indices(len(other.trials), 1)])
    return {channel: float(np.median(values)) if values else 0.0 for channel, values in found.items()}


def _compare(trials: Sequence[Trial]) -> _Group:
    curves = [_curves(trial) for trial in trials]
    channels = set.intersection(*(set(found) for found in curves))
    ranges = {c: float(np.median([max(np.ptp(v) for _, v in found[c]) for found in curves])) for c in channels}
    differences = {}
    for channel in sorted(c for c in channels if ranges[c] > 0.0):
        differences[channel] = np.zeros((len(trials), len(trials)))
        for i in range(len(trials)):
            for j in range(i):
                far = _rms_difference(curves[i][channel], curves[j][channel]) / ranges[channel]
                differences[channel][i, j] = differences[channel][j, i] = far
    return _Group(trials, differences, ranges)


def _rms_difference(one: Sequence[Curve], other: Sequence[Curve]) -> float:
    """RMS difference over the range where both were recorded."""
    squares, spans = [], []
    for (at_one, values_one), (at_other, values_other) in zip(one, other, strict=True):
        low, high = max(at_one[0], at_other[0]), min(at_one[-1], at_other[-1])
        if low < high:
            at = np.linspace(low, high, _POINTS)
            squares.append(np.mean((np.interp(at, at_one, values_one) - np.interp(at, at_other, values_other)) ** 2))
            spans.append(high - low)
    return float(np.sqrt(np.average(squares, weights=spans))) if spans else 0.0


def _curves(trial: Trial) -> dict[str, list[Curve]]:
    """The curves of a trial that are compared, by channel; a loading as its two branches."""
    columns = trial.columns
    if trial.experiment in ("static_loading", "anchor_pull"):
        mm, force_N = columns["displacement_mm"], columns["force_N"]
        turn = int(np.argmax(mm))
        return {"force_N": [_sorted(mm[part], force_N[part]) for part in (slice(turn + 1), slice(turn, None))]}
    switches = [np.flatnonzero(np.diff(values)) for name, values in columns.items() if is_command(name)]
    first = int(min((rows[0] for rows in switches if rows.size), default=0))
    time_s = trial.time_s - trial.time_s[first]
    found = {name: values for name, values in columns.items() if name.startswith("pressure")}
    if trial.experiment == "step_response":
        found["displacement_mm"] = columns["displacement_mm"]
    elif "displacement_tail_mm" in columns:
        found[_LENGTH] = columns["displacement_head_mm"] - columns["displacement_tail_mm"]
    return {name: [(time_s, values)] for name, values in found.items()}


def _sorted(at: np.ndarray, values: np.ndarray) -> Curve:
    order = np.argsort(at, kind="stable")
    return at[order], values[order]


def _unit(channel: str) -> str:
    return channel.rsplit("_", 1)[1]
