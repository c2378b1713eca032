"""The identification of section IV: starting point, joint fit, and the resulting uncertainty."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from bifa.data import Dataset
from bifa.identify.completed import described
from bifa.identify.start import fit_statics, prepare
from bifa.identify.static import StaticFit
from bifa.problem.inputs import ANCHOR
from bifa.problem.stiffness import UndeterminedError
from bifa.problem.system import CURVE_OF, PIPE, RobotSystem
from bifa.robot import Model
from lacuna.estimation.fit import Fit, fit_base, rms_by_channel
from lacuna.estimation.problem import Problem
from lacuna.estimation.settle import settle
from lacuna.estimation.solve import one_thread, solve
from lacuna.estimation.uncertainty import CONFIDENCE, Uncertainty, clustered_covariance, profile_interval, uncertainty

_NORMAL_HALF = round(NormalDist().inv_cdf(0.5 + CONFIDENCE / 2), 4)  # half-width in standard deviations
# mu_s shows in a single sample of each pull, the breakaway, so its cost is not quadratic.
_PROFILED = "mu_s"

_DETERMINES = {  # experiments, and the parameters that each determines
    "step_response of the large actuator": ("body_damping_Ns_m", "body_alpha_n_per_s", "body_alpha_s_per_s"),
    "static_loading of the large actuator at two pressures or more, one of them 0": ("body_area_N_psi",),
    "step_response of the small actuator": ("small_damping_Ns_m", "small_alpha_n_per_s", "small_alpha_s_per_s"),
    "static_loading of the small actuator at two pressures or more, one of them 0": ("small_area_N_psi",),
    "anchor_pull at three pressures": PIPE,
    "locomotion, or a gauge": ("supply_positive_psi",),
    "step_response, or a gauge": ("supply_negative_psi",),
    "a balance (a step response does not determine the moving mass)": ("head_mass_kg", "tail_mass_kg", "small_mass_kg"),
    "a balance": ("head_segment_mass_kg",),
    "pressing a head against a force gauge (a pull cannot separate it from friction and offset)": (
        "wall_stiffness_N_m",
    ),
    "an impact test at 1 kHz or more": ("wall_damping_Ns_m",),
}
_GIVEN_BY = {name: experiment for experiment, names in _DETERMINES.items() for name in names}


@dataclass(frozen=True)
class Open:
    """A parameter that this data set does not determine: its value in the model, and what would determine it."""

    name: str
    value: float
    needs: str


@dataclass(frozen=True)
class IntervalEstimate:
    """`value` with its standard deviation `sd` and its interval `lower` to `upper` at level `CONFIDENCE`."""

    value: float
    sd: float
    lower: float
    upper: float


@dataclass(frozen=True)
class Identification:
    """What a data set says about the robot: the identified `model`, its covariance included; the joint `fit` and the
    `uncertainty` of every fitted parameter; 90 % `intervals`, from the profile likelihood where the quadratic
    approximation misleads; the static stage by actuator; what is left `open`; the `error` by experiment and channel,
    RMS in units of the noise floor."""

    system: RobotSystem
    model: Model
    fit: Fit
    uncertainty: Uncertainty
    intervals: Mapping[str, IntervalEstimate]
    statics: Mapping[str, StaticFit]
    open: tuple[Open, ...]
    error: Mapping[tuple[str, str], float]


@one_thread
def identify(
    dataset: Dataset,
    model: Model | None = None,
    *,
    date: str = "",
    on_progress: Callable[[str], None] = lambda stage: None,
) -> Identification:
    """Identify the robot of `dataset`, starting from `model` (default: nominal): first from static loadings, rests and
    sensors alone, then jointly from all experiments. `date`: of the fit, for the model's provenance. Deterministic.
    Raises UndeterminedError if nothing at all can be fitted."""
    system = prepare(dataset, model, on_progress)
    on_progress("all experiments together, pressures included")
    fit = fit_base(system, system.trials)
    if not rms_by_channel(fit.problem.trials, fit.scaled_residuals()):
        raise UndeterminedError("none of these trials can be simulated with the model: check their pressures and units")
    on_progress("final steps and uncertainty")
    fit = settle(fit)
    known = uncertainty(fit)
    intervals = _intervals(system, fit, known)
    intervals |= _profiles(fit, intervals)
    sd = {name: interval.sd for name, interval in intervals.items()}
    identified = described(system.model_at(fit.theta), fit, known, "bifa fit", date, sd)
    return Identification(
        system=system,
        model=identified,
        fit=fit,
        uncertainty=known,
        intervals=intervals,
        statics=fit_statics(dataset),
        open=_open(system, identified, dataset, known, intervals),
        error=rms_by_channel(fit.problem.trials, fit.scaled_residuals()),
    )


def _intervals(system: RobotSystem, fit: Fit, known: Uncertainty) -> dict[str, IntervalEstimate]:
    """Quadratic intervals, widened where the experiments contradict one another by more than their noise."""
    spread = np.sqrt(np.diag(clustered_covariance(fit)))
    found = {}
    for estimate, between in zip(known.estimates, spread, strict=True):
        if estimate.name in system.fitted and estimate.determined:
            sd = max(estimate.sd, float(between))
            low, high = estimate.value - _NORMAL_HALF * sd, estimate.value + _NORMAL_HALF * sd
            parameter = system.model.parameters[estimate.name]
            low, high = max(low, parameter.lower), min(high, parameter.upper)
            found[estimate.name] = IntervalEstimate(estimate.value, sd, low, high)
    return found


def _profiles(fit: Fit, intervals: Mapping[str, IntervalEstimate]) -> dict[str, IntervalEstimate]:
    """Profile interval from the pulls alone, the rest held at the joint fit; never narrower than the quadratic one."""
    pulls = [trial for trial in fit.problem.trials if trial.experiment == ANCHOR]
    if not pulls or not all(name in intervals for name in PIPE):
        return {}
    free = tuple(fit.structure.names.index(name) for name in PIPE)
    problem = Problem(fit.structure, pulls, fit.problem.floor)
    local = Fit(problem, solve(problem, problem.start(fit.solution.point.values), free=free))
    old = intervals[_PROFILED]
    low, high = profile_interval(local, _PROFILED)
    low, high = min(low, old.lower), max(high, old.upper)
    return {_PROFILED: IntervalEstimate(old.value, max(old.sd, (high - low) / 2.0 / _NORMAL_HALF), low, high)}


_SETTLED = 0.7  # of the prior's standard deviation: at this ratio half of the information is the prior's


def _open(
    system: RobotSystem,
    identified: Model,
    dataset: Dataset,
    known: Uncertainty,
    intervals: Mapping[str, IntervalEstimate],
) -> tuple[Open, ...]:
    prior_sd = {p.name: p.prior_sd for p in system.parameters}
    # parameters that the data determine hardly better than the prior count as open
    sd = {e.name: intervals[e.name].sd if e.name in intervals else e.sd for e in known.estimates}
    resolved = {*dataset.known}
    resolved |= {
        e.name for e in known.estimates if e.determined and sd[e.name] <= _SETTLED * (prior_sd[e.name] or np.inf)
    }
    names = [n for n in identified.parameters if n not in resolved]
    found = [Open(n, identified[n], _GIVEN_BY[n]) for n in names]
    for actuator, prefix in CURVE_OF.items():
        if prefix not in system.curves:
            needs = f"static_loading of the {actuator} actuator at 0 psi"
            found.append(Open(f"{prefix} stiffness curve", float("nan"), needs))
    return tuple(found)
