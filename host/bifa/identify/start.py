"""The starting point of identification, from static loadings, rests and sensors alone (section IV).

Static loading gives the stiffness curve K and the area a of each actuator; the rest positions in step responses pin K
beyond the static range; supplies are read off the sensors. Everything else is found by the joint fit over all
experiments, by continuation (`lacuna.estimation.graduated`).
"""

from collections.abc import Callable, Mapping

import numpy as np

from bifa import robot
from bifa.data import Dataset
from bifa.identify.static import StaticFit, fit_static
from bifa.problem.curves import FittedCurve
from bifa.problem.stiffness import UndeterminedError
from bifa.problem.switches import step_timeline
from bifa.problem.system import CURVE_OF, RobotSystem, fittable
from bifa.problem.unmeasured import PRIOR_SD
from bifa.robot import Model, ModelParameterError
from lacuna.estimation.solve import one_thread

_SUPPLY_SETTLED = 0.98  # quantile of a walk's pressure that is taken for its supply
_SETTLED_MM_S = 0.5  # slower than this an actuator is at rest
_SAMPLES = 20  # from which that is judged
_PRESSURE_SD_PSI = 0.05  # of a mean reading; one count is 0.037 psi


@one_thread
def prepare(
    dataset: Dataset, model: Model | None = None, on_progress: Callable[[str], None] = lambda stage: None
) -> RobotSystem:
    """Return a system ready to be fitted to `dataset`. Values that the lab knows come from the data set; curves, areas
    and supplies start from the static stage, everything else from `model` (default: nominal), a base model.
    `on_progress` receives each stage's name. Raises UndeterminedError if nothing can be fitted, ModelParameterError if
    the model has effects or learnt curves."""
    if not dataset.trials:
        raise UndeterminedError("the data set holds no trials: nothing can be fitted")
    model = model or robot.nominal()
    if tables := [f"[effects.{name}]" for name in model.effects] + [f"[learnt.{name}]" for name in model.learnt]:
        raise ModelParameterError(
            f"model {model.name!r} has {', '.join(tables)}, but a fit starts from a base model: give one without them, "
            "such as the nominal one; `bifa diagnose` finds effects and curves again (with `--suspect EFFECT` it "
            "always tries one that was named before)"
        )
    on_progress("static loading: stiffness and area")
    statics = fit_statics(dataset)
    values = _known(dataset, model) | _supplies(dataset, model) | _areas(statics, model)
    curves = {CURVE_OF[a]: _curve(dataset, fit, values, model) for a, fit in statics.items()}
    for actuator, fit in statics.items():
        _refuse_unstable(actuator, fit, curves[CURVE_OF[actuator]])
    system = RobotSystem(dataset, model.with_values(values), curves, fittable(dataset, curves))
    if not system.parameters:
        raise UndeterminedError("these trials constrain no unknown parameter of the model")
    return system


def before_fit(model: Model) -> Model:
    """The base model of a fitted one, with nominal values of the parameters that have priors: what a fit found is no
    prior for another fit to the same trials."""
    return model.base.with_values({name: robot.nominal()[name] for name in PRIOR_SD})


def fit_statics(dataset: Dataset) -> dict[str, StaticFit]:
    """Static fits of the actuators loaded at 0 psi; step responses, if any, limit how far the curve is continued."""
    found = {}
    for actuator in CURVE_OF:
        try:
            found[actuator] = fit_static(dataset, actuator, _reach_m(dataset, actuator))
        except UndeterminedError:
            continue  # the model's own curve is kept, and the report says so
    return found


def _areas(statics: Mapping[str, StaticFit], model: Model) -> dict[str, float]:
    """Areas of the static stage. Raises UndeterminedError for one that no actuator has."""
    found = {}
    for actuator, fit in statics.items():
        if fit.area_N_psi is not None:
            parameter, area = model.parameters[f"{CURVE_OF[actuator]}_area_N_psi"], fit.area_N_psi
            try:
                found[parameter.name] = parameter.with_value(area).value
            except ModelParameterError as error:
                raise UndeterminedError(
                    f"the static loadings of the {actuator} actuator contradict their pressures: {error}. Check the "
                    "sign and unit of force_N, and each trial's pressure_psi and actuator in dataset.toml"
                ) from None
    return found


def _curve(dataset: Dataset, fit: StaticFit, values: Mapping[str, float], model: Model) -> FittedCurve:
    """The static curve, pinned at the actuator's rest positions in step responses."""
    prefix, stiffness = CURVE_OF[fit.actuator], fit.stiffness
    name = f"{prefix}_area_N_psi"
    area = values.get(name, model[name])
    rest_m, held_psi = _rests(dataset, fit.actuator).T
    if len(rest_m):
        sd_N = np.full(len(rest_m), area * _PRESSURE_SD_PSI)
        stiffness = stiffness.with_equilibria(rest_m, area * held_psi, sd_N)
    return FittedCurve(prefix, stiffness, bool(len(rest_m) or dataset.of("locomotion")))


def _refuse_unstable(actuator: str, fit: StaticFit, curve: FittedCurve) -> None:
    """Raise UndeterminedError for a curve without two stable states, with which nothing can be simulated."""
    try:
        curve.tables.at((0.0,) * len(curve.names))
    except ModelParameterError:
        low_mm, high_mm = (1e3 * end for end in fit.stiffness.covered_m)
        raise UndeterminedError(
            f"the static loadings of the {actuator} actuator at 0 psi, from {low_mm:.1f} to {high_mm:.1f} mm, show no "
            "two stable states, in which the force rises through 0: load it from before the contracted to beyond the "
            "extended state, and check the sign of force_N"
        ) from None


def _known(dataset: Dataset, model: Model) -> dict[str, float]:
    unknown = [name for name in dataset.known if name not in model.parameters]
    if unknown:
        raise ModelParameterError(
            f"[known] in dataset.toml names {', '.join(unknown)}, which is not a parameter of the model; "
            f"there are {', '.join(model.parameters)}"
        )
    for name, value in dataset.known.items():
        try:
            model.parameters[name].check(value)
        except ModelParameterError as error:
            raise ModelParameterError(f"[known] in dataset.toml: {error}") from None
    return dict(dataset.known)


def _supplies(dataset: Dataset, model: Model) -> dict[str, float]:
    """Supplies that the lab did not measure, read off the sensors as initial values for the joint fit."""
    found = {}
    vacuum = [psi for actuator in CURVE_OF for _, psi in _rests(dataset, actuator) if psi < 0]
    if "supply_negative_psi" not in dataset.known and vacuum:
        found["supply_negative_psi"] = float(np.median(vacuum))
    walks = [t.columns["pressure_body_psi"] for t in dataset.of("locomotion") if t.pressure_psi is None]
    if "supply_positive_psi" not in dataset.known and walks:
        found["supply_positive_psi"] = float(np.median([np.quantile(p, _SUPPLY_SETTLED) for p in walks]))
    bounds = {name: (model.parameters[name].lower, model.parameters[name].upper) for name in found}
    return {name: float(np.clip(value, *bounds[name])) for name, value in found.items()}


def _rests(dataset: Dataset, actuator: str) -> np.ndarray:
    """Positions [m] at which the actuator rests in step responses, before each switch and at the end of the record, and
    the measured pressures [psi] that hold it there; shape (n, 2)."""
    found = []
    for trial in dataset.of("step_response", actuator):
        time_s = trial.elapsed_s
        for end in (*(t for t in step_timeline(trial).time_s if t > 0.0), time_s[-1] + 1.0):
            last = np.flatnonzero(time_s < end - 1e-9)[-_SAMPLES:]
            x = trial.columns["displacement_mm"][last]
            if len(last) == _SAMPLES and abs(np.polyfit(time_s[last], x, 1)[0]) < _SETTLED_MM_S:
                found.append((float(x.mean()) * 1e-3, float(trial.columns["pressure_psi"][last].mean())))
    return np.reshape(found, (-1, 2))


def _reach_m(dataset: Dataset, actuator: str) -> tuple[float, float] | None:
    """Smallest and largest displacement in the actuator's step responses [m], without outliers of the noise."""
    trials = dataset.of("step_response", actuator)
    if not trials:
        return None
    limits = [np.percentile(trial.columns["displacement_mm"], (0.5, 99.5)) for trial in trials]
    return float(min(low for low, _ in limits)) * 1e-3, float(max(high for _, high in limits)) * 1e-3
