"""The robot and its bench as a `System`, the engine's interface for `bifa fit` and `bifa diagnose`.

Displacements of single actuators are those of the data set (0 where the testing machine reads 0). The simulator counts
from the contracted equilibrium of K, so the two differ by its position, which is 0 if the instruments were zeroed well.
"""

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from operator import itemgetter
from typing import Any

import numpy as np

from bifa import robot
from bifa.data import Dataset, DatasetError, Trial
from bifa.effects import EffectParameter, PhysicalEffect, library
from bifa.errors import BifaError
from bifa.problem import candidates, regressors, sites
from bifa.problem.accuracy import accuracy_of
from bifa.problem.curves import FittedCurve
from bifa.problem.inputs import ANCHOR, STATIC, STEP, WALK, Columns, Inputs, RobotInTrial, inputs_of
from bifa.problem.unmeasured import BENCH, LOAD_CELL, PRIOR_SD, STAND_MASS
from bifa.robot import Model
from bifa.simulate import Plant, lanes, layout
from bifa.simulate.plant import of_values
from bifa.simulate.tables import tabulated
from lacuna.system import (
    CandidateExperiment,
    Channels,
    Correction,
    CorrectionSite,
    Effect,
    Parameter,
    Record,
    System,
    Theta,
    no_prediction,
)

_CACHES = ("_plant", "_own_values", "_unfitted", "_shapes")  # cached attributes of a system, not pickled
FRICTION_WOBBLE = 0.01  # relative standard deviation of friction from run to run
_ADC_COUNT_PSI = 30.0 / 819.0  # 10 bits, 10-90 % of the supply over +-15 psi
_EXACT_M = {STATIC: 1e-6, STEP: 2e-7, ANCHOR: 1e-6, WALK: 3e-7}
_COARSE_M = {STATIC: 1e-6, STEP: 1e-6, ANCHOR: 1e-6, WALK: 1e-6}
_ALIKE_M = {STATIC: 1e-6, STEP: 1e-6, ANCHOR: 1e-6, WALK: 1e-5}  # errors of shared steps cancel in differences

_LARGE = ("body_damping_Ns_m", "body_area_N_psi", "body_alpha_n_per_s", "body_alpha_s_per_s")
_SMALL = ("small_damping_Ns_m", "small_area_N_psi", "small_alpha_n_per_s", "small_alpha_s_per_s")
PIPE = ("wall_offset_m", "mu_s", "mu_k")
# A pull fits about as well with the wall a centimetre nearer and less friction; only walks distinguish the two.
_PLACES = {"wall_offset_m": (0.017, 0.022, 0.026, 0.031)}
_SUPPLIES = ("supply_positive_psi", "supply_negative_psi")
_WALL = ("wall_stiffness_N_m", "wall_damping_Ns_m")
CURVE_OF = {"large": "body", "small": "small"}  # prefix of an actuator's parameters, and the name of its curve
_MACHINE = {"displacement_mm": "the cross-head", "force_N": "the load cell"}  # what a testing machine measures
_MASSES = ("head_mass_kg", "tail_mass_kg", "small_mass_kg")
_BENCH_TRIALS = {STAND_MASS: (STEP, "large"), LOAD_CELL: (ANCHOR, None)}
# The parameters that each experiment depends on; `matters` adds the shapes of the curves.
_DEPENDENCIES: dict[tuple[str, str | None], frozenset[str]] = {
    (STATIC, "large"): frozenset({"body_area_N_psi"}),
    (STATIC, "small"): frozenset({"small_area_N_psi"}),
    (STEP, "large"): frozenset({*_LARGE, "supply_negative_psi"}),
    (STEP, "small"): frozenset({*_SMALL, "small_mass_kg", "supply_negative_psi"}),
    (ANCHOR, None): frozenset({"small_area_N_psi", "head_segment_mass_kg", "wall_stiffness_N_m", *PIPE}),
    (WALK, None): frozenset({*_LARGE, *_SMALL, *PIPE, *_SUPPLIES, *_MASSES, *_WALL}),
}
# By experiment: the quantity that is varied, and the least number of settings from which one is never fitted.
_VARIED: dict[str, tuple[Callable[[Trial], float], int]] = {
    STATIC: (lambda trial: trial.commanded_psi, 3),
    STEP: (lambda trial: trial.commanded_psi, 2),
    ANCHOR: (lambda trial: trial.commanded_psi, 3),
    WALK: (lambda trial: trial.walked["period_s"], 3),
}


class RobotSystem(System):
    """The robot's base model, its library of effects, and the trials of a data set. `model`: initial values of the
    parameters `fitted`, and values of the others. `curves`: the fitted stiffness curves, "body" and "small", whose
    shapes are parameters; an actuator without one keeps the model's curve."""

    name = "pipe robot"

    def __init__(self, dataset: Dataset, model: Model, curves: Mapping[str, FittedCurve], fitted: Sequence[str]):
        _refuse_dead_machine(dataset)
        self.dataset, self.model, self.curves = dataset, model, dict(curves)
        self.fitted = tuple(fitted)
        self.accuracies: Mapping[str, float] = {}  # by quantity, the RMS error below which a prediction is good enough
        self.trials = tuple(_engine_trial(trial) for trial in dataset.trials)
        self._last_in_session = max((t.session_order or 0 for t in self.trials), default=0)
        self.effects: Mapping[str, Effect] = engine_effects()
        shapes = [p for curve in self.curves.values() for p in curve.parameters]
        # constants of the bench that these trials depend on and that were not declared
        felt = {(t.experiment, t.actuator) for t in dataset.trials if LOAD_CELL not in t.extra}
        bench = (BENCH[name] for name, where in _BENCH_TRIALS.items() if where in felt)
        self.parameters = (*(self._named(name) for name in self.fitted), *bench, *shapes)
        self._build_caches()

    def _build_caches(self) -> None:
        self._plant = lru_cache(maxsize=512)(self._plant_of)
        self._own_values = _picked(self.fitted)
        self._unfitted = {name: p.value for name, p in self.model.parameters.items() if name not in self.fitted}
        self._shapes = {prefix: _picked(curve.names) for prefix, curve in self.curves.items()}

    def __getstate__(self) -> dict[str, Any]:
        """State for pickling, without the caches."""
        return {n: value for n, value in vars(self).items() if n not in _CACHES}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._build_caches()

    # -- the System protocol ----------------------------------------------------------------------------------

    def predict(
        self,
        theta: Theta,
        effects: tuple[str, ...],
        trial: Record,
        *,
        coarse: bool = False,
        corrections: Sequence[Correction] = (),
    ) -> Channels:
        return self.predict_trials([theta], effects, [trial], coarse=coarse, corrections=[corrections])[0]

    forks = True  # the compiled code has neither threads nor state
    tells_of_all = True

    @property
    def at_once(self) -> int:  # type: ignore[override]  # a property, since the call may compile
        return lanes.width()

    def predict_trials(
        self,
        thetas: Sequence[Theta],
        effects: tuple[str, ...],
        trials: Sequence[Record],
        *,
        coarse: bool = False,
        corrections: Sequence[Sequence[Correction]] = (),
        alike: bool = False,
    ) -> list[Channels]:
        """Predict each trial at its own theta. Trials with the same `bench` are simulated side by side."""
        learnt = corrections or [()] * len(thetas)
        benches: dict[Hashable, dict[int, RobotInTrial[Inputs]]] = defaultdict(dict)
        for k, (theta, curves, trial) in enumerate(zip(thetas, learnt, trials, strict=True)):
            if (case := self._case(theta, curves, effects, trial)) is not None:
                benches[trial.payload.bench][k] = case
        tolerances_m = _EXACT_M if not coarse else _ALIKE_M if alike and self.at_once > 1 else _COARSE_M
        found: dict[int, Channels] = {}
        for cases in benches.values():
            experiment = trials[next(iter(cases))].experiment
            simulated = _simulated(list(cases.values()), tolerances_m[experiment], alike)
            for (k, case), channels in zip(cases.items(), simulated, strict=True):
                if channels:
                    seen = sites.corrected_readings(dict(channels), learnt[k], case.inputs, case.plant)
                    found[k] = {name: seen[name] for name in trials[k].channels}
        return [found[k] if k in found else no_prediction(trial) for k, trial in enumerate(trials)]

    def _case(
        self, theta: Theta, learnt: Sequence[Correction], effects: tuple[str, ...], trial: Record
    ) -> RobotInTrial[Inputs] | None:
        """A robot in a trial; None if there is no such robot because its stiffness curve is not bistable."""
        # 0 for the day's first trial, or if the order was not recorded; 1 for its last
        place = (trial.session_order or 0) / max(self._last_in_session, 1)
        try:
            plant, zeros = self._plant(self._key(theta, effects))
            plant = sites.corrected(plant, learnt, place)
        except BifaError:
            return None
        inputs: Inputs = sites.corrected_inputs(trial.payload, learnt, plant, place)
        return RobotInTrial(inputs, _plant_in_trial(plant, trial, theta, inputs.positive_psi), zeros, theta)

    def regressors(self, trial: Record, prediction: Channels) -> dict[str, np.ndarray]:
        return regressors.of(trial, prediction)

    def nuisances(self, trial: Record) -> tuple[Parameter, ...]:
        found = []
        if trial.experiment in (ANCHOR, WALK):
            source, both = "friction differs from run to run", ("mu_s", "mu_k")
            found.append(
                Parameter("friction_scale", "", 1.0, 0.8, 1.25, scale=FRICTION_WOBBLE, source=source, factor_of=both)
            )
        if trial.experiment in (STEP, WALK) and (sd := trial.payload.switch_sd_s) > 0.0:
            source = "the valves switched between two samples"
            found.append(Parameter("switch_late_s", "s", 0.0, -3.0 * sd, 3.0 * sd, scale=sd, source=source))
        if trial.experiment == ANCHOR:
            # Repeats are sampled at the same times, so that the same half sample may be missing in all of them.
            half_s = 0.5 * trial.payload.sample_s
            alike = sum(other.condition == trial.condition for other in self.trials)
            sd, source = half_s * np.sqrt(max(alike, 1) / 3.0), "the peak lies between two samples"
            found.append(Parameter("slip_late_s", "s", 0.0, -2.0 * half_s, 2.0 * half_s, scale=sd, source=source))
        return tuple(found)

    def spare(self) -> tuple[tuple[str, Hashable], ...]:
        return spare(self.dataset)

    def matters(self, parameter: str, trial: Record) -> bool:
        actuator = trial.payload.actuator
        if parameter in BENCH:
            return (trial.experiment, actuator) == _BENCH_TRIALS[parameter]
        if "_shape_" not in parameter:
            return parameter in _DEPENDENCIES[trial.experiment, actuator]
        prefix = parameter.split("_", 1)[0]
        if actuator is not None and prefix != CURVE_OF[actuator]:
            return False
        if trial.experiment == ANCHOR and prefix == "body":
            return False
        return trial.experiment in (STATIC, STEP) or parameter in self.curves[prefix].felt

    def isolates(self, trial: Record) -> bool:
        return trial.experiment != WALK

    def accuracy(self, experiment: str, channel: str) -> float:
        return accuracy_of(channel, self.accuracies)

    def sensor_noise(self, experiment: str, channel: str) -> float:
        """The quantisation noise of the analog-to-digital converter for pressures; 0 for the others."""
        return _ADC_COUNT_PSI / np.sqrt(12.0) if channel.startswith("pressure") else 0.0

    @cached_property
    def correction_sites(self) -> Mapping[str, CorrectionSite]:
        return sites.declared(self.model, self.curves)

    def candidate_experiments(self) -> tuple[CandidateExperiment, ...]:
        return tuple(
            CandidateExperiment(recorded.experiment, settings, _engine_trial(recorded, measured=False))
            for settings, recorded in candidates.of(self.dataset)
        )

    # -- from a vector to a model -----------------------------------------------------------------------------

    def model_at(self, theta: Theta, effects: Iterable[str] = ()) -> Model:
        """The model with the values of `theta`, springs included, and these effects active, without learnt curves."""
        values = {name: theta[name] for name in self.fitted}
        chosen = {
            effect: {p.name: theta[f"{effect}.{p.name}"] for p in self.effects[effect].parameters} for effect in effects
        }
        curves: dict[str, Any] = {
            f"{prefix}_stiffness": curve.curve(self._shapes[prefix](theta)) for prefix, curve in self.curves.items()
        }
        # Learnt curves and a covariance belong to the values of the fit that they come from.
        base = replace(self.model, learnt={}, covariance=None)
        return replace(base.with_values(values).with_effects(chosen), **curves)

    def _named(self, name: str) -> Parameter:
        p = self.model.parameters[name]
        low, high = p.plausible
        prior_sd = PRIOR_SD.get(name)
        # friction affects fewer samples: wider steps for its derivatives
        scale = prior_sd or (high - low) * (1.0 if name in PIPE else 0.1)
        # An end that slides at once shows no static friction: below mu_k, no gradient would bring mu_s back.
        at_least, elsewhere = "mu_k" if name == "mu_s" else None, _PLACES.get(name, ())
        return Parameter(
            name, p.unit, p.value, p.lower, p.upper, p.plausible, scale, p.source, prior_sd, at_least, elsewhere
        )

    def _key(self, theta: Theta, effects: tuple[str, ...]) -> tuple[Any, ...]:
        """A hashable key of everything that a plant depends on."""
        weights = tuple((prefix, shapes(theta)) for prefix, shapes in self._shapes.items())
        all_of = {effect: self.effects[effect].parameters + self.effects[effect].own for effect in effects}
        extra = tuple(
            (effect, tuple((p.name, theta.get(f"{effect}.{p.name}", p.value)) for p in parameters))
            for effect, parameters in all_of.items()
        )
        return self._own_values(theta), weights, extra

    def _plant_of(self, key: tuple[Any, ...]) -> tuple[Plant, tuple[float, float]]:
        """The model for compiled code, and where body and small actuator are contracted on the records' axes: at 0 by
        the format, but a curve fitted to static loadings has their axis."""
        named, weights, extra = key
        shapes = dict(weights)
        body, small = (
            self.curves[prefix].tables.at(shapes[prefix]) if prefix in shapes else tabulated(own)
            for prefix, own in (("body", self.model.body_stiffness), ("small", self.model.small_stiffness))
        )
        effects = {effect: dict(values) for effect, values in extra}
        values = self._unfitted | dict(zip(self.fitted, named, strict=True))
        values |= {f"{effect}.{name}": v for effect, own in effects.items() for name, v in own.items()}
        zeros_m = (body.contracted_m if "body" in shapes else 0.0, small.contracted_m if "small" in shapes else 0.0)
        return of_values(values, effects, body, small), zeros_m


def _refuse_dead_machine(dataset: Dataset) -> None:
    """Raise DatasetError if a testing machine's channel never changes: a fit would blame the robot."""
    for trial in (*dataset.of(STATIC), *dataset.of(ANCHOR)):
        for column, instrument in _MACHINE.items():
            if np.ptp(values := trial.columns[column]) == 0.0:
                raise DatasetError(
                    f"every sample reads {values[0]:g}: is {instrument} connected? Record this trial again, or remove "
                    "it from dataset.toml",
                    file=trial.file,
                    column=column,
                )


def fittable(dataset: Dataset, curves: Mapping[str, FittedCurve]) -> tuple[str, ...]:
    """Names of the model's parameters that these trials depend on and the data set does not declare as known."""
    seen = {name for trial in dataset.trials for name in _DEPENDENCIES[trial.experiment, trial.actuator]}
    return tuple(n for n in robot.nominal().parameters if n in seen and n not in dataset.known)


def _simulated(cases: Sequence[RobotInTrial[Inputs]], tolerance_m: float, alike: bool) -> list[Columns]:
    """Simulate the cases of one bench. Returns the channels of each, empty if it is out of range."""
    simulate: Callable[..., list[Columns]] = cases[0].inputs.simulate
    try:
        return simulate(cases, tolerance_m, alike)
    except BifaError:
        if len(cases) == 1:
            return [{}]
        return [_simulated([case], tolerance_m, alike)[0] for case in cases]


def _picked(names: Sequence[str]) -> Callable[[Theta], tuple[float, ...]]:
    """A function that picks these values from a mapping, as a tuple. It must be fast: every simulation calls it."""
    if len(names) < 2:  # itemgetter would not return a tuple
        return lambda theta: tuple(theta[name] for name in names)
    return itemgetter(*names)


def _engine_trial(trial: Trial, measured: bool = True) -> Record:
    inputs = inputs_of(trial)
    channels = {
        name: np.asarray(trial.columns[name], float) if measured else np.full(len(trial.time_s), np.nan)
        for name in inputs.channels
    }
    return Record(
        trial.file, trial.experiment, trial.condition, trial.time_s, channels, trial.session_order, payload=inputs
    )


def _plant_in_trial(plant: Plant, trial: Record, theta: Theta, positive_psi: float | None) -> Plant:
    """`plant` in one trial, with that trial's friction, supply and mass moving on the stand."""
    friction = theta.get("friction_scale", 1.0)
    q = plant.q.copy()
    q[layout.MU_S] *= friction
    q[layout.MU_K] *= friction
    if positive_psi is not None:
        q[layout.SUPPLY_POSITIVE] = positive_psi
    if trial.experiment == STEP:
        q[layout.BODY + layout.MASS] = theta.get(STAND_MASS, q[layout.BODY + layout.MASS])
    return plant._replace(q=q)


def spare(dataset: Dataset) -> tuple[tuple[str, Hashable], ...]:
    """Select the held-out conditions, as (experiment, condition): for each experiment and actuator, those with the
    middle pressure or period (the lower of two), at every rate."""
    groups: dict[tuple[str, str | None], list[Trial]] = defaultdict(list)
    for trial in dataset.trials:
        groups[trial.experiment, trial.actuator].append(trial)
    found: dict[tuple[str, Hashable], None] = {}
    for (experiment, _), trials in groups.items():
        setting, fewest = _VARIED[experiment]
        levels = sorted({setting(trial) for trial in trials})
        if len(levels) >= fewest:
            middle = levels[(len(levels) - 1) // 2]
            found |= dict.fromkeys((experiment, t.condition) for t in trials if setting(t) == middle)
    return tuple(found)


def engine_effects() -> dict[str, Effect]:
    """All effects of `bifa.effects`, with their sizes first among the parameters."""
    return {name: _engine_effect(effect) for name, effect in library().items()}


def _engine_effect(effect: PhysicalEffect) -> Effect:
    ordered = sorted((p for p in effect.parameters if not p.own), key=lambda p: not p.size)
    return Effect(
        name=effect.name,
        parameters=tuple(_engine_parameter(p) for p in ordered),
        enters=effect.enters,
        experiments=effect.experiments,
        equation=effect.equation,
        source=effect.source,
        sizes=len(effect.sizes),
        own=tuple(_engine_parameter(p) for p in effect.parameters if p.own),
        freed_at=effect.freed_at,
        apart=effect.apart,
        frequency=next((p.name for p in effect.parameters if p.frequency), None),
    )


def _engine_parameter(p: EffectParameter) -> Parameter:
    lower, upper = p.lower, p.upper
    # a trial's own value may be anywhere within its bounds
    scale = 0.25 * (upper - lower) if p.own else 0.3 * abs(p.typical) or 0.05 * (upper - lower)
    if p.period is not None:
        lower, upper = p.typical - 0.5 * p.period, p.typical + 0.5 * p.period
    return Parameter(
        p.name, p.unit, p.typical, lower, upper, scale=scale, source=p.meaning, periodic=p.period is not None
    )
