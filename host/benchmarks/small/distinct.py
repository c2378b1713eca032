"""Whether a set is decidable: how close each offered explanation can come to the noiseless truth."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.optimize import least_squares

from benchmarks.small.offered import Offered
from benchmarks.systems.problem import absent
from lacuna import Effect
from lacuna.values import Values

_BEGUN = (1.0, 0.4, 2.0)  # starting points, as multiples of the declared sizes
_RIGHT = 0.8  # largest error, in noises, that the true candidates may leave
_WRONG = 1.1  # least error, in noises, that everything else must leave,
_APART = 1.7  # and as a multiple of what the true candidates leave


def tellable(offered: Offered, clean: Sequence[np.ndarray], truth: Sequence[str], base: float, noise: float) -> bool:
    """Whether the offered effects of `truth` explain the data, and nothing smaller or different does. `base`: error of
    the base model at its best."""
    library = {e.name: e for e in offered.effects}
    there = [library[name] for name in truth if name in library]
    right = left_by(offered, clean, there) / noise if there else base / noise
    least = max(_WRONG, _APART * right) if there else _WRONG
    if there and right > _RIGHT:
        return False
    others = [e for e in offered.effects if e.name not in truth]
    alone: dict[str, float] = {}
    for effect in [*others, *(there if len(there) > 1 else [])]:
        alone[effect.name] = left_by(offered, clean, [effect]) / noise
        if alone[effect.name] < least:
            return False
    return bool(there) or _no_pair(offered, clean, others, alone, noise)


def _no_pair(offered: Offered, clean: Sequence[np.ndarray], others: Sequence[Effect], alone, noise: float) -> bool:
    """Whether no two of the three best candidates together explain the withheld effect."""
    best = sorted(others, key=lambda e: alone[e.name])[:3]
    return all(left_by(offered, clean, pair) / noise > 0.9 for pair in combinations(best, 2))


def left_by(offered: Offered, clean: Sequence[np.ndarray], effects: Sequence[Effect] = ()) -> float:
    """RMS difference from the noiseless truth after the best of a few fits; differences that a run's drift could
    explain do not count."""
    return closest(offered, clean, effects)[1]


def closest(offered: Offered, clean: Sequence[np.ndarray], effects: Sequence[Effect]) -> tuple[dict[str, float], float]:
    """The best fit: values by full name, and the remaining RMS difference."""
    named = [(p.name, p) for p in offered.parameters] + [(e.full_name(p), p) for e in effects for p in e.parameters]
    lower, upper = (np.array([getattr(p, end) for _, p in named]) for end in ("lower", "upper"))
    scale = np.array([abs(p.value) for _, p in named])
    sizes = {name for e in effects for name in e.size_names}
    off, runs = absent(offered.effects), _one_a_condition(offered)
    unit = max(float(np.std(np.concatenate(clean))), 1e-12)

    def residual(x: np.ndarray) -> np.ndarray:
        theta = Values(off | dict(zip((name for name, _ in named), x * scale, strict=True)))
        found = [offered.model(r, theta)[offered.kind.output] - y for r, y in zip(runs, clean, strict=True)]
        if offered.nuisances:
            found = [_without_drift(r.time_s, z) for r, z in zip(runs, found, strict=True)]
        return np.nan_to_num(np.concatenate(found) / unit, nan=1e3, posinf=1e3, neginf=-1e3).clip(-1e3, 1e3)

    tried = []
    for factor in _BEGUN if effects else _BEGUN[:1]:
        start = np.array([p.value * (factor if name in sizes else 1.0) for name, p in named])
        start = np.clip(start, lower + 1e-6 * scale, upper - 1e-6 * scale)
        bounds = (lower / scale, upper / scale)
        tried.append(least_squares(residual, start / scale, bounds=bounds, max_nfev=20, xtol=1e-5, ftol=1e-5))
    best = min(tried, key=lambda one: one.cost)
    return dict(zip((n for n, _ in named), best.x * scale, strict=True)), unit * float(np.sqrt(np.mean(best.fun**2)))


def _one_a_condition(offered: Offered):
    first = {}
    for run in offered.runs:
        first.setdefault(run.condition, run)
    records = {r.name: r for r in offered.records}
    return [records[run.name] for run in first.values()]


def _without_drift(time_s: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """The residual less its straight line."""
    columns = np.column_stack([np.ones(len(time_s)), time_s / time_s[-1]])
    return residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
