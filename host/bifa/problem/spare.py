"""Conditions that are never fitted, so that an explanation is judged by what it predicts: settings between others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable

from bifa.data import Dataset, Trial
from bifa.problem.inputs import ANCHOR, STATIC, STEP, WALK

# By experiment: what is varied, and of how many settings at least one may be spared.
_VARIED: dict[str, tuple[Callable[[Trial], float], int]] = {
    STATIC: (lambda trial: trial.commanded_psi, 3),
    STEP: (lambda trial: trial.commanded_psi, 2),
    ANCHOR: (lambda trial: trial.commanded_psi, 3),
    WALK: (lambda trial: trial.walked["period_s"], 3),
}


def spare(dataset: Dataset) -> tuple[tuple[str, Hashable], ...]:
    """(experiment, condition) of one setting of each experiment and actuator: the middle pressure or period (of two
    pressures of a step the lower), at every rate."""
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
