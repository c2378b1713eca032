"""Which trials are fitted, which choose between explanations, and which are never looked at until the end."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from bifa.identify.system import Trial


@dataclass(frozen=True)
class Split:
    """`fit` and `select` inform the choice; `final` (the held-out trials) never do."""

    fit: tuple[Trial, ...]
    select: tuple[Trial, ...]
    final: tuple[Trial, ...]

    @property
    def known(self) -> tuple[Trial, ...]:
        return self.fit + self.select


def split_trials(trials: Sequence[Trial]) -> Split:
    """Split by whole trials. Of three or more repeats of a condition one goes to `final` and one to
    `select`, which one rotates from condition to condition, so that no part has all the early or all the
    late runs of a session; of two, every other condition gives one away; where there are no repeats, every
    fifth trial is held out and every fourth selects."""
    groups: dict[object, list[Trial]] = defaultdict(list)
    for trial in trials:
        groups[trial.experiment, trial.condition].append(trial)
    parts: dict[str, list[Trial]] = {"fit": [], "select": [], "final": []}
    pairs = 0
    singles = [members[0] for members in groups.values() if len(members) == 1]
    for turn, members in enumerate(groups.values()):
        if len(members) == 1:
            continue
        if len(members) == 2:
            parts["fit"].append(members[pairs % 2])
            parts["select" if pairs % 2 else "final"].append(members[1 - pairs % 2])
            pairs += 1
            continue
        for place, trial in enumerate(members):
            role = {0: "final", 1: "select"}.get((place + turn) % len(members), "fit")
            parts[role].append(trial)
    for place, trial in enumerate(singles):
        role = "final" if place % 5 == 4 else "select" if place % 5 == 2 else "fit"
        parts[role].append(trial)
    order = {trial.name: k for k, trial in enumerate(trials)}
    return Split(**{role: tuple(sorted(ts, key=lambda t: order[t.name])) for role, ts in parts.items()})
