"""How walks differ from a fitted model beyond its covariance: between runs, over a session, and unexplained."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import cast

import numpy as np
from scipy.special import ndtri, stdtrit

from bifa.problem.inputs import ANCHOR, STATIC, STEP, WALK
from bifa.problem.switches import seconds_per_uno_s
from bifa.problem.system import FRICTION_WOBBLE, RobotSystem
from bifa.robot.model import Scatter
from lacuna.diagnosis.nuisances import runs_of
from lacuna.estimation.fit import Fit
from lacuna.system import Channels, Record

_PRIOR_RUNS = 5  # weight of the prior, in runs that vary as expected beforehand
_UPPER_QUANTILE = 0.95  # quantile at the upper end of a 90 % interval
_LAST = 50  # samples of a walk, over which its end is averaged


def scatter_of(fit: Fit) -> Scatter:
    """Estimate the scatter on the fitted trials; rounded, since it is based on some tens of runs."""
    found = {
        "friction": _between_runs(fit),
        "pressure_psi": _unexplained(fit, (STEP, WALK), "pressure"),
        "force_N": _unexplained(fit, (STATIC, ANCHOR), "force"),
        "speed": _speed(fit),
    }
    for name, drift in session_drifts(fit).items():
        found[name] = float(np.hypot(found[name], drift))
    rounded = {name: float(f"{value:.4g}") for name, value in found.items()}
    return replace(switch_timing(cast(RobotSystem, fit.structure.system)), **rounded)


def session_drifts(fit: Fit) -> dict[str, float]:
    """RMS over the session of each learnt drift, by the scatter it adds to: the next walk may be anywhere in one."""
    learnt = {c.site: float(np.sqrt(np.mean(c.table**2))) for c in fit.structure.corrections(fit.theta)}
    own = cast(RobotSystem, fit.structure.system).model  # has the values that are known and so not fitted
    area_N_psi, supply_psi = (fit.theta.get(name, own[name]) for name in ("body_area_N_psi", "supply_positive_psi"))
    found = {
        "friction": learnt.get("friction_of_the_day", 0.0),
        "pressure_psi": learnt.get("vacuum_of_the_day", 0.0),
        "force_N": learnt.get("area_of_the_day", 0.0) * area_N_psi * supply_psi,
    }
    return {name: drift for name, drift in found.items() if drift > 0.0}


def switch_timing(system: RobotSystem) -> Scatter:
    """The Uno's timekeeping, means over the walks that note it: near the edge, 0.25 % of the period or a few
    milliseconds decide."""
    walks = [trial for trial in system.dataset.trials if trial.experiment == WALK]
    clocks = [seconds_per_uno_s(trial) for trial in walks if "clock_rate" in trial.extra]
    dead_times_s = [trial.extra["dead_time_s"] for trial in walks if "dead_time_s" in trial.extra]
    return Scatter(
        clock=round(float(np.mean(clocks or [1.0])), 6),
        dead_time_s=round(float(np.mean(dead_times_s or [0.0])), 6),
        tick_s=max((trial.extra.get("tick_s", 0.0) for trial in walks), default=0.0),
    )


def _between_runs(fit: Fit) -> float:
    """Standard deviation of the friction factor between runs, combined with its prior."""
    factors = [run.value for run in runs_of([fit]) if run.nuisance.name == "friction_scale"]
    square = sum((value - 1.0) ** 2 for value in factors) + _PRIOR_RUNS * FRICTION_WOBBLE**2
    return float(np.sqrt(square / (len(factors) + _PRIOR_RUNS)))


def _unexplained(fit: Fit, experiments: Sequence[str], quantity: str) -> float:
    """RMS of the part of a quantity's residuals that repeats of a condition share, over those of `experiments`."""
    shared = _shared(fit, experiments, lambda _, residual: _joined(residual, quantity))
    return float(np.sqrt(max(float(np.mean(shared)), 0.0))) if shared else 0.0


def _shared(fit: Fit, experiments: Sequence[str], part: Callable[[Record, Channels], np.ndarray]) -> list[float]:
    """Mean square shared by the repeats of each condition of `experiments`, in the `part` of their residuals if any."""
    residuals = fit.residuals()
    conditions: dict[object, list[np.ndarray]] = {}
    for trial in fit.problem.trials:
        if trial.experiment in experiments and (values := part(trial, residuals[trial.name])).size:
            conditions.setdefault((trial.experiment, trial.condition), []).append(values)
    return [shared_square(repeats) for repeats in conditions.values()]


def shared_square(repeats: Sequence[np.ndarray]) -> float:
    """Mean product of the residuals of two repeats, free of noise on average; for a single repeat its mean square."""
    length = min(map(len, repeats))
    rows = np.array([values[:length] for values in repeats])
    if len(rows) == 1:
        return float(np.mean(rows**2))
    count = len(rows)
    return float(np.mean(rows.sum(axis=0) ** 2 - (rows**2).sum(axis=0)) / (count * (count - 1)))


def _joined(residual: Channels, quantity: str) -> np.ndarray:
    joined = np.concatenate([np.zeros(0), *(v for name, v in residual.items() if name.startswith(quantity))])
    return joined[np.isfinite(joined)]


def _speed(fit: Fit) -> float:
    """Standard deviation of the relative error in the predicted distance of walks, as far as repeats share it."""

    def off(walk: Record, residual: Channels) -> np.ndarray:
        way_mm = _end(walk.channels)
        share = np.array([_end(residual) / way_mm] if abs(way_mm) > 1.0 else [])
        return share[np.isfinite(share)]

    return sd_of_few(_shared(fit, (WALK,), off))


def sd_of_few(squares: Sequence[float]) -> float:
    """Standard deviation from a few `squares`: that of the normal distribution with the same 90 % interval as Student's
    t for the next gait, since few gaits determine an RMS badly. 0 if there are none."""
    if not squares:
        return 0.0
    wider = stdtrit(len(squares), _UPPER_QUANTILE) / ndtri(_UPPER_QUANTILE)
    return float(wider * np.sqrt(max(float(np.mean(squares)), 0.0)))


def _end(channels: Channels) -> float:
    """Position of the head at the end, in mm."""
    return float(np.mean(channels["displacement_head_mm"][-_LAST:]))
