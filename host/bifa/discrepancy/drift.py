"""Does something change over the session? Repeats in a row hide it; the order of the trials shows it."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from scipy.stats import rankdata

from bifa.identify.fit import Fit

_SHUFFLES = 2000
_CHANCE = 0.002
_FEWEST = 6


def find_drift(fitted: Fit, *, seed: int = 0) -> tuple[str, ...]:
    """Names of base parameters whose value, as each single trial would have it, moves with `session_order`.

    Each trial's residual is projected on the derivative by each parameter: the shift that this trial alone
    asks for. Its rank correlation with the order is held against shuffled orders, all parameters at once.
    """
    trials = fitted.problem.trials
    ordered = [k for k, t in enumerate(trials) if t.session_order is not None]
    if len(ordered) < _FEWEST or not fitted.solution.sensitivities:
        return ()
    residuals, jacobians = fitted.problem.residuals(fitted.solution.point), fitted.solution.jacobians
    groups: dict[object, list[int]] = defaultdict(list)
    for k in ordered:
        groups[trials[k].experiment, trials[k].condition].append(k)
    order = np.array([float(trials[k].session_order) for k in ordered])
    place = {k: i for i, k in enumerate(ordered)}
    shifts = {}
    for column, index in enumerate(fitted.solution.free):
        if index >= fitted.structure.base_size:
            continue
        shift = np.zeros(len(ordered))
        for members in groups.values():
            asked = [_asked(residuals[k], jacobians[k][0][:, column]) for k in members]
            centred = np.array(asked) - np.mean(asked)
            spread = np.sqrt(np.mean(centred**2))
            for k, value in zip(members, centred, strict=True):
                shift[place[k]] = value / spread if spread > 0 else 0.0
        if np.any(shift):
            shifts[fitted.structure.names[index]] = shift
    if not shifts:
        return ()
    within = np.zeros(len(ordered))
    for members in groups.values():
        at = [place[k] for k in members]
        within[at] = order[at] - order[at].mean()
    names, table = list(shifts), np.array([rankdata(s) - (len(ordered) + 1) / 2 for s in shifts.values()])
    observed = np.abs(table @ within)
    draw = np.random.default_rng(seed)
    chance = np.empty((_SHUFFLES, len(names)))
    for s in range(_SHUFFLES):
        shuffled = within.copy()
        for members in groups.values():
            at = [place[k] for k in members]
            shuffled[at] = draw.permutation(within[at])
        chance[s] = np.abs(table @ shuffled)
    unit = np.maximum(chance.std(axis=0), 1e-12)
    limit = np.quantile((chance / unit).max(axis=1), 1 - _CHANCE)
    return tuple(n for n, o, u in zip(names, observed, unit, strict=True) if o / u > limit)


def _asked(residual: np.ndarray, derivative: np.ndarray) -> float:
    square = float(derivative @ derivative)
    return -float(derivative @ residual) / square if square > 0 else 0.0
