"""Graduated fits, for starts far from the optimum: residuals are first smoothed and weighted loosely, then ever less.

If a record jumps (a snap-through, a foot that slips) and its prediction jumps at another time, they differ by the whole
jump until the two times coincide, and the cost has no gradient towards that. Low-passed, the two overlap, and with a
raised floor large residuals still count, so that the same search converges (graduated optimisation; Blake and
Zisserman, Visual Reconstruction, 1987). Trials that isolate parameters go first, since in the others, where everything
acts together, errors accumulate over time. If isolating trials fit equally well at several values
(`Parameter.elsewhere`), all trials together decide.
"""

from collections.abc import Sequence

import numpy as np

from lacuna.estimation.problem import SHARP, Problem, View
from lacuna.estimation.solve import REL_TOL, Solution, solve

_COARSE, _MEDIUM, _FINE = View(1 / 20, 30.0, 30.0), View(1 / 60, 10.0, 30.0), View(1 / 200, 3.0, 30.0)
_ISOLATED_VIEWS = (_COARSE, _MEDIUM, _FINE)
_ALTERNATIVE_VIEW = View(raised=10.0)
_REL_TOL, _MAX_ITERATIONS = 1e-3, 40  # of a smoothed search; the tolerance is relative to the cost
_SAME_START_SCALES = 0.2  # scales: starts that end within this of one another are one
_PREFERENCE_RATIO = 0.9  # of the cost reached from the original start; another start must come below it to be preferred
# Log-likelihood and multiple of the least cost; starts that exceed both are dropped.
_NEGLIGIBLE_COST, _MAX_COST_RATIO = 0.02, 3.0


def solve_graduated(
    problem: Problem, values: np.ndarray, *, max_iterations: int, relative: float = REL_TOL
) -> Solution:
    """Minimise the cost from distant `values`. Parameters with a prior stay at its mean until the others are close."""
    structure, every = problem.structure, range(len(values))
    isolated = problem.over([t for t in problem.trials if structure.system.isolates(t)])
    free = [i for i, p in enumerate(structure.parameters) if p.prior_sd is None]
    values = np.where(np.isin(every, free), values, structure.prior_mean())
    if isolated.trials:  # a small part of the total work
        values = _solve_views(isolated, values, _ISOLATED_VIEWS, free).point.values
        values = _solve_views(isolated, values, (SHARP,), every).point.values
    hidden = [j for j in every if not any(structure.moves(j, t) for t in isolated.trials)]
    starts = [values, *_alternative_starts(isolated, values, free)]
    # parameters fitted to isolating trials stay fixed at first: smoothed residuals say little about them
    for view, moving in ((_COARSE, hidden), (_MEDIUM, every)):
        found = [_solve_views(problem, start, (view,), moving, max_iterations) for start in starts]
        least = min(one.cost for one in found)
        found = [one for one in found if one.cost <= max(_NEGLIGIBLE_COST, _MAX_COST_RATIO * least)]
        starts = [one.point.values for one in found]
    # of similar costs, the earlier start is preferred
    best = found[0] if least > _PREFERENCE_RATIO * found[0].cost else min(found, key=lambda one: one.cost)
    return solve(problem, problem.start(best.point.values), max_iterations=max_iterations, relative=relative)


def _solve_views(
    problem: Problem,
    values: np.ndarray,
    views: Sequence[View],
    free: Sequence[int],
    max_iterations: int = _MAX_ITERATIONS,
) -> Solution:
    """Minimise the cost under each of `views` in turn, starting from the previous result, and return the last."""
    for view in views:
        distant = problem.seen(view)
        found = solve(distant, distant.start(values), free=free, max_iterations=max_iterations, relative=_REL_TOL)
        values = found.point.values
    return found


def _alternative_starts(isolated: Problem, values: np.ndarray, free: Sequence[int]) -> list[np.ndarray]:
    """Further starts: the distinct optima of the isolating trials from each value in `Parameter.elsewhere`. For each
    such parameter, those in `free` that only the same trials depend on are fitted to these trials; the others stay."""
    structure = isolated.structure
    found: list[np.ndarray] = []
    shown = {j: frozenset(t.name for t in isolated.trials if structure.moves(j, t)) for j in free}
    for index in free:
        parameter = structure.parameters[index]
        trials = [t for t in isolated.trials if t.name in shown[index]]
        if not trials or not parameter.elsewhere:
            continue
        problem = isolated.over(trials)
        alike = [j for j in free if shown[j] and shown[j] <= shown[index]]
        for place in parameter.elsewhere:
            start = np.where(np.arange(len(values)) == index, place, values)
            end = _solve_views(problem, start, (_ALTERNATIVE_VIEW,), alike).point.values
            known = (values, *found)
            if all(abs(end[index] - other[index]) > _SAME_START_SCALES * parameter.step_scale for other in known):
                found.append(end)
    return found
