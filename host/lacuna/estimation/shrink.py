"""Shrink learnt curves where the data do not determine them to the size that they have where the data do.

The prior of a curve is wide, so that no curve is shrunk before its size is known. Outside the range of the trials, such
a prior would let the curve extrapolate with its slope and leave its value there almost unconstrained. Once the curve is
learnt, the data determine its size, which then becomes the prior for the rest (empirical Bayes with MacKay's update;
Bayesian interpolation, 1992).
"""

from dataclasses import replace

import numpy as np

from lacuna.estimation.fit import Fit
from lacuna.estimation.solve import solve
from lacuna.estimation.structure import knot_names
from lacuna.estimation.uncertainty import uncertainty

_UPDATES = 100
_MIN_SIZE = 1e-3  # scales of a site: smallest size, that of a curve that is only noise
_MAX_VARIANCE_SHARE = 0.5  # of a knot's prior variance: the data determine a knot if its posterior variance is smaller


def shrunk(fitted: Fit) -> Fit:
    """Return the fit with the likeliest size of each learnt curve as the prior of its knots. Knots that the data do not
    determine restart at zero, and everything else is refitted with the existing derivatives."""
    structure, solution = fitted.structure, fitted.solution
    if not structure.sites:
        return fitted
    values, sizes, known = solution.point.values.copy(), {}, uncertainty(fitted).covariance
    for name in structure.sites:
        site = structure.system.correction_sites[name]
        places = np.array([structure.names.index(knot) for row in knot_names(site) for knot in row])
        own = np.array([solution.free.index(place) for place in places])
        sizes[name], determined = likeliest_size(values[places], known[np.ix_(own, own)], _MIN_SIZE * site.scale)
        values[places[~determined]] = 0.0
    problem, begin = fitted.problem.with_prior(sizes=sizes), replace(solution.point, values=values)
    solution = solve(problem, begin, free=solution.free, sensitivities=solution.sensitivities)
    return replace(fitted, problem=problem, solution=solution)


def likeliest_size(values: np.ndarray, covariance: np.ndarray, least: float) -> tuple[float, np.ndarray]:
    """Return the standard deviation, at least `least`, that makes `values`, shape (n,), known with `covariance`, the
    likeliest draw, and a mask of the values that the data then determine."""
    variances, ways = np.linalg.eigh(covariance)
    variances, along = np.maximum(variances, 0.0), (ways.T @ values) ** 2
    square = max(float(np.mean(values**2)), least**2)
    for _ in range(_UPDATES):
        determined = square / (variances + square)
        square = max(float(along @ determined**2 / determined.sum()), least**2)
    after = ways**2 @ (variances * square / (variances + square))
    return float(np.sqrt(square)), after < _MAX_VARIANCE_SHARE * square
