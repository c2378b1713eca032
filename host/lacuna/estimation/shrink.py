"""Learnt curves that are no larger where the data say nothing than where they speak.

The prior of a curve is wide, so that none is held back before its size is known. Where no trial went it would let the
curve swing as far as its slope leads, and say that it may be anything there. Once the curve is learnt, the data tell
its size, and that is what is expected of the rest (empirical Bayes; the update is MacKay's, Bayesian interpolation,
1992).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lacuna.estimation.fit import Fit
from lacuna.estimation.solve import solve
from lacuna.estimation.structure import knot_name
from lacuna.estimation.uncertainty import uncertainty

_UPDATES = 100
_NONE = 1e-3  # scales of a site: the size of a curve that is but noise
_TOLD = 0.5  # of a knot's variance beforehand: where the data leave less, they speak


def shrunk(fitted: Fit) -> Fit:
    """The fit with the knots of each learnt curve known beforehand to within its size, at zero where the data do not
    speak, and all else following by the derivatives that there are."""
    structure, solution = fitted.structure, fitted.solution
    if not structure.sites:
        return fitted
    values, sizes, known = solution.point.values.copy(), {}, uncertainty(fitted).covariance
    for name in structure.sites:
        site = structure.system.correction_sites[name]
        knots = [knot_name(site, row, knot) for row in range(len(site.rows)) for knot in range(site.knots)]
        places = np.array([structure.names.index(knot) for knot in knots])
        own = np.array([solution.free.index(place) for place in places])
        sizes[name], told = likeliest_size(values[places], known[np.ix_(own, own)], _NONE * site.scale)
        values[places[~told]] = 0.0
    problem, begin = fitted.problem.with_prior(sizes=sizes), replace(solution.point, values=values)
    solution = solve(problem, begin, free=solution.free, sensitivities=solution.sensitivities)
    return replace(fitted, problem=problem, solution=solution)


def likeliest_size(values: np.ndarray, covariance: np.ndarray, least: float) -> tuple[float, np.ndarray]:
    """The standard deviation of which `values` (n,), known to within `covariance`, are the likeliest draw, or `least`;
    and which of them the data tell then."""
    variances, ways = np.linalg.eigh(covariance)
    variances, along = np.maximum(variances, 0.0), (ways.T @ values) ** 2
    square = max(float(np.mean(values**2)), least**2)
    for _ in range(_UPDATES):
        told = square / (variances + square)
        square = max(float(along @ told**2 / told.sum()), least**2)
    after = ways**2 @ (variances * square / (variances + square))
    return float(np.sqrt(square)), after < _TOLD * square
