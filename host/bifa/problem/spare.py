"""Held-out conditions, with settings that lie between others: explanations are judged by their predictions there."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable

from bifa.data import Dataset, Trial
from bifa.problem.inputs import ANCHOR, STATIC, STEP, WALK

# By experiment: the quantity that is varied, and the least number of settings from which one may be held out.
_VARIED: dict[str, tuple[Callable[[Trial], float], int]] = {
    STATIC: (lambda trial: trial.commanded_psi, 3),
    STEP: (lambda trial: trial.commanded_psi, 2),
    ANCHOR: (lambda trial: trial.commanded_psi, 3),
    WALK: (lambda trial: trial.walked["period_s"], 3),
}


def spare(dataset: Dataset) -> tuple[tuple[str, Hashable], ...]:
    """Select the held-out conditions, as (experiment, condition): for each experiment and actuator, those with the
    middle pressure or period (the lower of two), at every rate."""
    groups: dict[tuple[str, str | None], list[Trial]] = defaultdict(list)
    for trial in dataset.trials:
        groups[trial.experiment, trial.actuator].append(trial)
    found: dict[tuple[str, Hashable], None] = {}
    for (experiment, _), trials in groups.items():
        setting, fewest = _VARIED[experiment]
        levels = sorted({setting(trial) for trial in trials})
        if len(levels) >= fewest:
            middle = levels[(len(levels) - 1) // 2]
            found |= dict.fromkeys((experiment, t.condition) for t in trials if setting(t) == middle)
    return tuple(found)
