"""Differential evolution (Storn and Price), SciPy's, one batch a generation: of the whole space, or basin by basin."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import optimize

from .cma_es import basins
from .common import Evaluated, Objective, OnEvaluated, RecordedObjective, distances

# Of the search basin by basin. Populations go from any of their members part of the way to the best, which follows
# ridges; with more of the mutant in each trial (0.9) one search in seven ends half-way along.
_MEMBERS = 24
_BY_BASIN: dict[str, Any] = {"strategy": "randtobest1bin", "mutation": (0.3, 0.9), "recombination": 0.8}
_FREE, POPULATIONS = 2, 4  # how many go where they like, since one may end early on a lesser top; and how many in all
_APART = 0.3  # of a basin's gaits from the tops of the others, on some axis of the unit cube


def differential_evolution(
    objective: Objective,
    wraps: np.ndarray,
    evaluations: int,
    seed: int,
    on_progress: OnEvaluated | None = None,
    population: int = 50,
) -> Evaluated:
    """Maximise `objective` with about `evaluations` calls; `wraps` (dimensions,) marks full turns.

    A full turn is searched over one and a half, so that no optimum lies at an end.
    """
    recorder = RecordedObjective(objective, wraps, on_progress)
    bounds = _bounds(wraps, 0.25)
    _evolve(recorder, bounds, _initial(bounds, population, seed), evaluations, seed, recombination=0.8)
    return recorder.found()


def evolve_basins(
    recorder: RecordedObjective, seen: Evaluated, wraps: np.ndarray, shape: np.ndarray, evaluations: int, seed: int
) -> Evaluated:
    """Maximise what is recorded in one basin after another, with about `evaluations` calls a population: sequential
    niching (Beasley, Bull and Martin 1993). Populations begin from tops of `seen`, another objective's values. The
    later ones keep clear of the basins before them: what is near their tops on all of the axes `shape` (dimensions,)
    counts nothing.
    """
    tops: list[np.ndarray] = []

    def elsewhere(points: np.ndarray) -> np.ndarray:
        away = np.ones(len(points), dtype=bool)
        for top in tops if len(tops) >= _FREE else []:
            away &= distances(points[:, shape], top[shape], wraps[shape]) >= _APART
        return away

    def apart(points: np.ndarray) -> np.ndarray:
        points, values = np.where(wraps, np.mod(points, 1.0), points), np.zeros(len(points))
        counts = elsewhere(points)
        if counts.any():
            values[counts] = recorder(points[counts])
        return values

    for number in range(POPULATIONS):
        left = elsewhere(seen.points)
        begun = basins(Evaluated(seen.points[left], seen.values[left]), wraps, _MEMBERS)
        others = np.random.default_rng([seed, number]).random((_MEMBERS - len(begun), len(wraps)))
        begun = np.vstack([begun.reshape(-1, len(wraps)), others])
        top = _evolve(apart, _bounds(wraps, 0.5), begun, evaluations, seed + number, **_BY_BASIN)
        tops.append(np.where(wraps, np.mod(top, 1.0), top))
    return recorder.found()


def _evolve(
    objective: Callable[[np.ndarray], np.ndarray],
    bounds: list[tuple[float, float]],
    begun: np.ndarray,
    evaluations: int,
    seed: int,
    strategy: str = "best1bin",
    mutation: tuple[float, float] = (0.4, 0.9),
    recombination: float = 0.8,
) -> np.ndarray:
    """(dimensions,) where the population `begun` (n, dimensions) has come to."""
    found: Any = optimize.differential_evolution(
        lambda columns: -objective(columns.T),
        bounds,
        strategy=strategy,
        maxiter=max(1, round(evaluations / len(begun)) - 1),
        init=begun,
        mutation=mutation,
        recombination=recombination,
        tol=0.0,
        atol=-1.0,  # never "converged" while a whole generation stands still at speed 0
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=np.random.default_rng(seed),
    )
    return np.asarray(found.x)


def _bounds(wraps: np.ndarray, beyond: float) -> list[tuple[float, float]]:
    return [(-beyond, 1.0 + beyond) if wrap else (0.0, 1.0) for wrap in wraps]


def _initial(bounds: list[tuple[float, float]], population: int, seed: int) -> np.ndarray:
    from scipy.stats import qmc

    lower, upper = np.transpose(bounds)
    sample = qmc.LatinHypercube(len(bounds), rng=np.random.default_rng([seed, 1])).random(population)
    return lower + sample * (upper - lower)
