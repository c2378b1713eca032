"""Intervals of fitted parameters that allow for a model that is not exact and for a likelihood that is not smooth."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from lacuna.estimation.clustered import clustered_covariance
from lacuna.estimation.fit import Fit
from lacuna.estimation.uncertainty import uncertainty

_CONFIDENCE = 0.9


def intervals(fitted: Fit) -> dict[str, tuple[float, float]]:
    """90 % interval of every parameter of a settled fit, within its bounds: by the curvature of the likelihood or by
    what conditions disagree about, whichever is wider; Student's t with as many degrees of freedom as conditions, less
    one."""
    known = uncertainty(fitted)
    variance = np.maximum(np.diag(known.covariance), np.diag(clustered_covariance(fitted)))
    variance += fitted.structure.grains()[list(fitted.solution.free)] ** 2 / 12.0  # anywhere within a step
    conditions = len({(t.experiment, t.condition) for t in fitted.problem.trials})
    half = np.sqrt(variance) * stdtrit(max(conditions - 1, 1), 0.5 + _CONFIDENCE / 2)
    found = {}
    for estimate, index, width in zip(known.estimates, fitted.solution.free, half, strict=True):
        parameter = fitted.structure.parameters[index]
        lower, upper = max(parameter.lower, estimate.value - width), min(parameter.upper, estimate.value + width)
        found[estimate.name] = (float(lower), float(upper))
    return found
