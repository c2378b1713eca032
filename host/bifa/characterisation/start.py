"""Identification in the paper's order, as far as each experiment by itself allows (section IV).

1. Static loading: the stiffness curve K and the area a of each actuator.
2. Step responses: equilibria pin K beyond the static range; b, alpha_n and alpha_s by differential evolution.
3. Anchor pulls: x_w, mu_s and mu_k, likewise.

What comes out is where the joint refinement over all experiments begins. The moving mass takes no part: a step
response cannot tell it, and an optimiser left free on it stalls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import differential_evolution

from bifa.data import Dataset
from bifa.identify.noise import estimate_noise
from bifa.identify.problem import SOFT_LIMIT, in_parallel
from bifa.identify.system import Parameter, Trial
from bifa.robot import Model, ParameterError

from .curves import FittedCurve
from .equilibria import pressure_sd_psi, reach_m, rests
from .errors import TooLittleDataError
from .inputs import ANCHOR, STEP, StepInputs
from .static import StaticFit, fit_static
from .system import RobotSystem, fittable

_ACTUATORS = {"large": "body", "small": "small"}
_DYNAMICS = ("damping_Ns_m", "alpha_n_per_s", "alpha_s_per_s")
_GRIP = ("wall_offset_m", "mu_s", "mu_k")
_THINNED = 4  # of a step response's samples one in so many serves the search
_POPULATION, _GENERATIONS = 8, 25
_FAILED = 1e12
_SUPPLY_SETTLED = 0.98  # quantile of a walk's pressure that stands for its supply

Progress = Callable[[str], None]


def start(dataset: Dataset, model: Model, seed: int = 0, progress: Progress = lambda stage: None) -> RobotSystem:
    """A system whose parameters stand where the stages leave them. `progress` is told each stage's name."""
    progress("static loading: stiffness and area")
    statics = fit_statics(dataset)
    values = _known(dataset, model) | _supplies(dataset, model)
    values |= {f"{_ACTUATORS[a]}_area_N_psi": fit.area_N_psi.value for a, fit in statics.items() if fit.area_N_psi}
    curves = {_ACTUATORS[a]: _curve(dataset, fit, values, model) for a, fit in statics.items()}
    system = _system(dataset, model, curves, values)
    if not system.parameters:
        raise TooLittleDataError("these trials tell none of the model's parameters that the lab does not know already")
    for actuator, prefix in _ACTUATORS.items():
        names = [n for n in (f"{prefix}_{name}" for name in _DYNAMICS) if n in system.fitted]
        trials = _one_of_each(t for t in system.trials if t.experiment == STEP and t.payload.actuator == actuator)
        if names and trials:
            progress(f"step responses of the {actuator} actuator: {', '.join(names)}")
            values |= _search(system, names, [_thinned(t) for t in trials], seed)
            system = _system(dataset, model, curves, values)
    names = [n for n in _GRIP if n in system.fitted]
    pulls = _one_of_each(t for t in system.trials if t.experiment == ANCHOR)
    if names and pulls:
        progress(f"anchor pulls: {', '.join(names)}")
        values |= _search(system, names, pulls, seed)
        system = _system(dataset, model, curves, values)
    return system


def fit_statics(dataset: Dataset) -> dict[str, StaticFit]:
    """Static fits by actuator, of those that were loaded at 0 psi. A curve without steps beside it continues alone."""
    found = {}
    for actuator in _ACTUATORS:
        try:
            found[actuator] = fit_static(dataset, actuator, reach_m(dataset, actuator))
        except TooLittleDataError:
            continue  # the model's own curve stands in; the report says so
    return found


def _curve(dataset: Dataset, fit: StaticFit, values: Mapping[str, float], model: Model) -> FittedCurve:
    """The static curve, pinned by where the actuator rested in step responses."""
    prefix = _ACTUATORS[fit.actuator]
    name = f"{prefix}_area_N_psi"
    area = values.get(name, model.parameters[name].value)
    seen = rests(dataset, fit.actuator)
    moves = bool(seen or dataset.of("locomotion"))
    if not seen:
        return FittedCurve(prefix, fit.stiffness, moves)
    sd = np.full(len(seen), area * pressure_sd_psi())
    pinned = fit.stiffness.with_equilibria(
        [rest.displacement_m for rest in seen], [area * rest.pressure_psi for rest in seen], sd
    )
    return FittedCurve(prefix, pinned, moves)


def _known(dataset: Dataset, model: Model) -> dict[str, float]:
    unknown = [name for name in dataset.known if name not in model.parameters]
    if unknown:
        raise ParameterError(
            f"dataset.toml knows {', '.join(unknown)}, which is no parameter of the model; "
            f"there are {', '.join(model.parameters)}"
        )
    return dict(dataset.known)


def _supplies(dataset: Dataset, model: Model) -> dict[str, float]:
    """Supplies that the lab did not measure, read off the sensors; the joint refinement has the last word."""
    found = {}
    vacuum = [r.pressure_psi for a in _ACTUATORS for r in rests(dataset, a) if r.pressure_psi < 0]
    if "supply_negative_psi" not in dataset.known and vacuum:
        found["supply_negative_psi"] = float(np.median(vacuum))
    walks = [t.columns["pressure_body_psi"] for t in dataset.of("locomotion") if t.pressure_psi is None]
    if "supply_positive_psi" not in dataset.known and walks:
        found["supply_positive_psi"] = float(np.median([np.quantile(p, _SUPPLY_SETTLED) for p in walks]))
    return {name: float(np.clip(v, *_bounds(model, name))) for name, v in found.items()}


def _bounds(model: Model, name: str) -> tuple[float, float]:
    return model.parameters[name].lower, model.parameters[name].upper


def _system(
    dataset: Dataset, model: Model, curves: Mapping[str, FittedCurve], values: Mapping[str, float]
) -> RobotSystem:
    return RobotSystem(dataset, model.with_values(values), curves, fittable(dataset, curves))


def _one_of_each(trials) -> list[Trial]:
    first: dict[object, Trial] = {}
    for trial in trials:
        first.setdefault(trial.condition, trial)
    return list(first.values())


def _thinned(trial: Trial) -> Trial:
    inputs: StepInputs = trial.payload
    keep = slice(None, None, _THINNED)
    return replace(
        trial,
        time_s=trial.time_s[keep],
        channels={name: values[keep] for name, values in trial.channels.items()},
        payload=replace(inputs, time_s=inputs.time_s[keep]),
    )


def _search(system: RobotSystem, names: Sequence[str], trials: Sequence[Trial], seed: int) -> dict[str, float]:
    """The best values of a few parameters by differential evolution (Storn and Price 1997), over the wider of the
    plausible range and a factor of two about it; the rest stands still."""
    floor = estimate_noise(system, trials)
    spread = [{channel: floor.sd(trial, channel) for channel in trial.channels} for trial in trials]
    parameters = {p.name: p for p in system.parameters}
    theta = {name: p.value for name, p in parameters.items()}
    bounds = [_search_bounds(parameters[name]) for name in names]

    def cost(vector: np.ndarray) -> float:
        tried = theta | dict(zip(names, map(float, vector), strict=True))
        total = 0.0
        for trial, sd in zip(trials, spread, strict=True):
            predicted = system.predict(tried, (), trial, coarse=True)
            for channel, measured in trial.channels.items():
                z = (predicted[channel] - measured) / sd[channel]
                if not np.isfinite(z).all():
                    return _FAILED
                total += float(np.sum(np.arcsinh(z / SOFT_LIMIT) ** 2))
        return total

    result = differential_evolution(
        lambda population: np.array(in_parallel(cost, population.T)),
        bounds,
        popsize=_POPULATION,
        maxiter=_GENERATIONS,
        seed=seed,
        polish=False,
        vectorized=True,
        updating="deferred",
        x0=np.clip([theta[name] for name in names], *np.array(bounds).T),
    )
    return dict(zip(names, map(float, result.x), strict=True))


def _search_bounds(parameter: Parameter) -> tuple[float, float]:
    low, high = parameter.plausible or (parameter.lower, parameter.upper)
    width = high - low
    return max(parameter.lower, low - 0.5 * width), min(parameter.upper, high + 0.5 * width)
