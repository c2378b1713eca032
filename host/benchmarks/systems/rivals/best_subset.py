"""Every set of up to three candidates, fitted with SciPy, and the Bayesian information criterion."""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from scipy.optimize import least_squares

from benchmarks.systems.problem import KnownProblem, RivalAnswer

LARGEST, STARTS = 3, 3


def solve(problem: KnownProblem, starts: int = STARTS) -> RivalAnswer:
    """The set with the least BIC; its parameters are fitted to all records at once."""
    sets = [chosen for size in range(LARGEST + 1) for chosen in combinations(problem.library, size)]
    found = {chosen: fit(problem, chosen, starts) for chosen in sets}
    best = min(sets, key=lambda chosen: bic(problem, found[chosen]))
    return RivalAnswer(best, lambda record: problem.predict(record, found[best]))


def fit(problem: KnownProblem, effects: Sequence[str] = (), starts: int = STARTS) -> dict[str, float]:
    """Least squares of the free-run error within the bounds, from the declared values and from draws around them."""
    names, parameters = zip(*problem.free(effects), strict=True)
    lower, upper = (np.array([getattr(p, end) for p in parameters]) for end in ("lower", "upper"))
    value = np.array([p.value for p in parameters])
    scale = np.where(value == 0.0, [p.step_scale for p in parameters], np.abs(value))

    def residual(x: np.ndarray) -> np.ndarray:
        found = problem.residual(dict(zip(names, x * scale, strict=True)), problem.fitted)
        return np.nan_to_num(found, nan=1e6, posinf=1e6, neginf=-1e6)  # the simulation may fail far from the optimum

    draw = np.random.default_rng(0)
    tried = []
    for start in range(starts):
        drawn = value * np.exp(0.5 * draw.standard_normal(len(value)) * (start > 0))
        first = np.clip(drawn, lower + 1e-9 * scale, upper - 1e-9 * scale)
        tried.append(
            least_squares(residual, first / scale, bounds=(lower / scale, upper / scale), ftol=1e-6, xtol=1e-6)
        )
    return dict(zip(names, min(tried, key=lambda one: one.cost).x * scale, strict=True))


def bic(problem: KnownProblem, found: Mapping[str, float]) -> float:
    """n ln(RSS / n) + k ln n, with n samples fitted and k the number of parameters in `found`."""
    residual = problem.residual(found, problem.fitted)
    return float(len(residual) * np.log(np.mean(residual**2)) + len(found) * np.log(len(residual)))
