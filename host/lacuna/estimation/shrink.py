"""Learnt curves that are no larger where the data say nothing than where they speak.

The prior of a curve is wide, so that none is held back before its size is known. Where no trial went it would let the
curve swing as far as its slope leads, and say that it may be anything there. Once the curve is learnt, the data tell
its size, and that is what is expected of the rest (empirical Bayes: Robbins 1956).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lacuna.estimation.fit import Fit
from lacuna.estimation.solve import solve
from lacuna.estimation.structure import knot_name
from lacuna.estimation.uncertainty import uncertainty


def shrunk(fitted: Fit) -> Fit:
    """The fit with each learnt curve at zero where the data do not determine it, its knots known beforehand to within
    the RMS of those that they do, and all else following by the derivatives that there are."""
    structure, solution = fitted.structure, fitted.solution
    determined = {estimate.name for estimate in uncertainty(fitted).estimates if estimate.determined}
    values, sizes = solution.point.values.copy(), {}
    for name in structure.sites:
        site = structure.system.correction_sites[name]
        knots = [knot_name(site, row, knot) for row in range(len(site.rows)) for knot in range(site.knots)]
        told = np.array([knot in determined for knot in knots])
        places = np.array([structure.names.index(knot) for knot in knots])
        size = np.sqrt(np.mean(values[places[told]] ** 2)) if told.any() else 0.0
        if size > 0.0:
            values[places[~told]], sizes[name] = 0.0, float(size)
    if not sizes:
        return fitted
    problem, begin = fitted.problem.sized(sizes), replace(solution.point, values=values)
    solution = solve(problem, begin, free=solution.free, sensitivities=solution.sensitivities)
    return replace(fitted, problem=problem, solution=solution)
