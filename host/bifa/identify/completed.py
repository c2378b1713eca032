"""The identified model with uncertainties, sources of its values, and what a diagnosis added to it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

import numpy as np

from bifa.identify.scatter import scatter_of
from bifa.problem.sites import learnt_curves
from bifa.problem.system import RobotSystem
from bifa.robot import Model
from bifa.robot.model import LEARNT, Covariance
from bifa.simulate import plant
from lacuna.estimation.fit import Fit
from lacuna.estimation.structure import is_learnt, knot_names
from lacuna.estimation.uncertainty import Uncertainty, clustered_covariance, uncertainty


def completed_model(fit: Fit, date: str = "") -> Model:
    """Return the fitted model, effects and learnt curves included, with its covariance and the scatter beyond it, for
    `bifa simulate` and `bifa optimize`. `date`: of the fit, for the provenance."""
    structure = fit.structure
    model = cast(RobotSystem, structure.system).model_at(fit.theta, structure.effects)
    model = replace(model, learnt=learnt_curves(plant(model), structure.corrections(fit.theta)))
    return described(model, fit, uncertainty(fit), "bifa diagnose", date)


def described(
    model: Model, fit: Fit, known: Uncertainty, command: str, date: str = "", sd: Mapping[str, float] | None = None
) -> Model:
    """Return `model`, fitted by `fit`, with the uncertainty of its values, the scatter of walks beyond it, and labels.
    `sd`: standard deviations that override those of `known`."""
    model = replace(_with_uncertainty(model, fit, known, sd or {}), scatter=scatter_of(fit))
    return labeled(model, cast(RobotSystem, fit.structure.system), command, date)


def _with_uncertainty(model: Model, fit: Fit, known: Uncertainty, sd: Mapping[str, float]) -> Model:
    """Return `model`, fitted by `fit`, with standard deviations and covariance of all values that the data determine,
    those of curves included. Correlations are those of `known`; standard deviations are those of `sd`, otherwise the
    larger of the fit's own and that by which the conditions of the data contradict one another."""
    moves, between = _moves(model, fit), np.sqrt(np.diag(clustered_covariance(fit)))
    # a curve needs all its knots: a spline through some of them would overshoot at the others
    chosen = [k for k, e in enumerate(known.estimates) if (e.determined or is_learnt(e.name)) and e.name in moves]
    if not chosen:
        return model
    moved = np.where([is_learnt(e.name) for e in known.estimates], 0.0, between)  # the curve's size bounds its knots
    widths = {known.estimates[k].name: max(known.estimates[k].sd, float(moved[k])) for k in chosen} | dict(sd)
    fitted = [known.estimates[k].name for k in chosen]
    matrix = known.covariance[np.ix_(chosen, chosen)]
    stretch = np.array([widths[name] for name in fitted]) / np.sqrt(np.diag(matrix))
    names = tuple(dict.fromkeys(value for name in fitted for value in moves[name]))
    ways = np.array([[moves[name].get(value, 0.0) for name in fitted] for value in names]) * stretch
    parameters = {name: replace(p, sd=widths[name]) if name in widths else p for name, p in model.parameters.items()}
    return replace(model, parameters=parameters, covariance=Covariance(names, ways @ matrix @ ways.T))


def _moves(model: Model, fit: Fit) -> dict[str, dict[str, float]]:
    """Map each parameter of the fit to the values of `model` that it changes (its own or a curve's), per unit."""
    structure = fit.structure
    system = cast(RobotSystem, structure.system)
    own = {*system.fitted, *(name for name in structure.names if name.split(".")[0] in structure.effects)}
    found = {name: {name: 1.0} for name in own}
    for curve in system.curves.values():
        found |= curve.changes
    for site, learnt in model.learnt.items():
        knots = system.correction_sites[site].knots
        each = (learnt.values.shape[1] - 1) // (knots - 1)
        for row, names in enumerate(knot_names(system.correction_sites[site])):
            found |= {name: {f"{LEARNT}.{site}.{row}.{knot * each}": 1.0} for knot, name in enumerate(names)}
    return found


def labeled(model: Model, system: RobotSystem, command: str, date: str = "") -> Model:
    """Return `model`, fitted to the data set of `system`, with a name, its provenance (with `date`, that of the fit,
    unless the same data have to give the same bytes), and the source of each value."""
    dataset = system.dataset
    sources = dict.fromkeys(dataset.known, f"[known] of {dataset.name}")
    sources |= dict.fromkeys(system.fitted, f"fitted to {dataset.name}")
    parameters = {name: replace(p, source=sources.get(name, p.source)) for name, p in model.parameters.items()}
    added = " and ".join((*model.effects, *(f"learnt {name}" for name in model.learnt))).replace("_", " ")
    on = f" on {date}" if date else ""
    return replace(
        model,
        name=f"{dataset.name} with {added}" if added else dataset.name,
        parameters=parameters,
        provenance=f"{command}{on}: fitted to {len(dataset.trials)} trials of {dataset.name}"
        + (f", completed by {added}" if added else ""),
    )
