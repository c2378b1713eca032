"""The model with what a diagnosis added to it, as `bifa simulate` and `bifa optimize` take it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bifa.identify.fit import Fit
from bifa.identify.uncertainty import uncertainty
from bifa.robot import Model
from bifa.robot.model import Covariance

from .robust import clustered_covariance, stretched


def completed_model(fit: Fit) -> Model:
    """The fitted values, effects included, with the covariance of those that the data determine. A learnt curve has no
    place in a model file and stays out."""
    structure = fit.structure
    system = structure.system
    model = system.model_at(fit.theta, structure.effects)
    known = uncertainty(fit)
    sd = np.sqrt(np.maximum(np.diag(known.covariance), np.diag(clustered_covariance(fit))))
    named = {*system.fitted, *(name for name in structure.names if name.split(".")[0] in structure.effects)}
    chosen = [k for k, e in enumerate(known.estimates) if e.determined and e.name in named]
    if not chosen:
        return model
    names = tuple(known.estimates[k].name for k in chosen)
    matrix = stretched(known.covariance[np.ix_(chosen, chosen)], sd[chosen])
    spread = dict(zip(names, sd[chosen].tolist(), strict=True))
    parameters = {n: replace(p, sd=spread[n]) if n in spread else p for n, p in model.parameters.items()}
    return replace(model, parameters=parameters, covariance=Covariance(names, matrix))
