"""The model with how well its values are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bifa.robot import Model
from bifa.robot.model import Covariance
from lacuna.estimation.uncertainty import Uncertainty


def with_uncertainty(model: Model, known: Uncertainty, sd: Mapping[str, float], source: str | None = None) -> Model:
    """The model with standard deviations for the values named in `sd`, and their covariance: correlations as `known`.

    source: where these values come from; None leaves what the parameters say.
    """
    if not sd:
        return model
    chosen = [k for k, e in enumerate(known.estimates) if e.name in sd]
    names = tuple(known.estimates[k].name for k in chosen)
    matrix = known.covariance[np.ix_(chosen, chosen)]
    stretch = np.array([sd[name] for name in names]) / np.sqrt(np.diag(matrix))
    parameters = {
        name: replace(p, sd=sd[name], source=source or p.source) if name in sd else p
        for name, p in model.parameters.items()
    }
    return replace(model, parameters=parameters, covariance=Covariance(names, matrix * np.outer(stretch, stretch)))
