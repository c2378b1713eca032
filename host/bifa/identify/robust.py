"""The identified model: how well its values are known, and where each comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bifa.pipe_robot.system import RobotSystem
from bifa.robot import Model
from bifa.robot.model import Covariance
from lacuna.estimation.uncertainty import Uncertainty


def with_uncertainty(model: Model, known: Uncertainty, sd: Mapping[str, float]) -> Model:
    """The model with standard deviations for the values named in `sd`, and their covariance, correlated as `known`."""
    if not sd:
        return model
    chosen = [k for k, e in enumerate(known.estimates) if e.name in sd]
    names = tuple(known.estimates[k].name for k in chosen)
    matrix = known.covariance[np.ix_(chosen, chosen)]
    stretch = np.array([sd[name] for name in names]) / np.sqrt(np.diag(matrix))
    parameters = {name: replace(p, sd=sd[name]) if name in sd else p for name, p in model.parameters.items()}
    return replace(model, parameters=parameters, covariance=Covariance(names, matrix * np.outer(stretch, stretch)))


def labelled(model: Model, system: RobotSystem, command: str, date: str = "") -> Model:
    """`model`, fitted to the data set of `system`, with its name, its provenance and the source of each value.

    date: of the fit; left out where the same data have to give the same bytes.
    """
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
