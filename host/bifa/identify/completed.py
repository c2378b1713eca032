"""The model with what a diagnosis added to it, as `bifa simulate` and `bifa optimize` take it."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from bifa.identify.robust import labelled, with_uncertainty
from bifa.identify.scatter import with_scatter
from bifa.pipe_robot.sites import learnt_curves
from bifa.pipe_robot.system import RobotSystem
from bifa.robot import Model
from bifa.simulate import plant
from lacuna.estimation.clustered import clustered_covariance
from lacuna.estimation.fit import Fit
from lacuna.estimation.uncertainty import uncertainty


def completed_model(fit: Fit, date: str = "") -> Model:
    """The fitted values, effects and a curve learnt in the robot's equations included, with the covariance of those
    values that the data determine and with the scatter beyond it. `date`: of the fit, for its provenance."""
    structure = fit.structure
    system = cast(RobotSystem, structure.system)
    model = system.model_at(fit.theta, structure.effects)
    model = replace(model, learnt=learnt_curves(plant(model), structure.corrections(fit.theta)))
    known = uncertainty(fit)
    sd = np.sqrt(np.maximum(np.diag(known.covariance), np.diag(clustered_covariance(fit))))
    named = {*system.fitted, *(name for name in structure.names if name.split(".")[0] in structure.effects)}
    spread = {e.name: float(s) for e, s in zip(known.estimates, sd, strict=True) if e.determined and e.name in named}
    model = with_scatter(with_uncertainty(model, known, spread), fit)
    return labelled(model, system, "bifa diagnose", date)
