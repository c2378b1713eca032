"""The model with what a diagnosis added to it, as `bifa simulate` and `bifa optimize` take it."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

from bifa.identify.robust import labeled, with_uncertainty
from bifa.identify.scatter import with_scatter
from bifa.problem.sites import learnt_curves
from bifa.problem.system import RobotSystem
from bifa.robot import Model
from bifa.simulate import plant
from lacuna.estimation.fit import Fit
from lacuna.estimation.uncertainty import uncertainty


def completed_model(fit: Fit, date: str = "") -> Model:
    """The fitted values, effects and a curve learnt in the robot's equations included, with the covariance of what the
    data determine and with the scatter beyond it. `date`: of the fit, for its provenance."""
    structure = fit.structure
    system = cast(RobotSystem, structure.system)
    model = system.model_at(fit.theta, structure.effects)
    model = replace(model, learnt=learnt_curves(plant(model), structure.corrections(fit.theta)))
    model = with_scatter(with_uncertainty(model, fit, uncertainty(fit)), fit)
    return labeled(model, system, "bifa diagnose", date)
