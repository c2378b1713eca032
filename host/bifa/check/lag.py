"""Lag of a trial's displacement behind its pressures, estimated from the two records alone, without a model.

A pressure is (F - b v) / a (paper, section III.A): each snap-through appears in it as a bump in the shape of the speed,
some 7 psi high and a few samples wide, on a force F that changes slowly. The lag is the shift of the displacement at
which its derivative explains the bump best: precise to some 0.2 ms between trials, accurate to 1 ms.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bifa.data import Trial

Motion = Callable[..., np.ndarray]  # (time_s, derivative's order) -> mm/s, as SciPy's splines

LIMIT_S = 3e-3  # between trials: a third of a sample; differences in the robot's motion shift it by less than 1 ms
LIMIT_OF_ALL_S = 9e-3  # common to all trials: a pressure sensor's filter may well take 8 ms; a whole sample is 10
REACH_S = 0.04  # largest lag that is searched, either way
_HALF_S = 0.12  # half the window about a snap-through
_STEP_S = 1e-3
_SNAP = 0.4  # of the greatest speed: slower motion is not a snap-through
_EXPLAINED = 0.9  # share of the bump's variance that must be explained for a window to count
_CURVATURE = 3  # columns of the slow force: a parabola over the window


@dataclass(frozen=True)
class Lag:
    """`late_s`: delay of the displacement relative to the pressure, negative if it is early; `sd_s`: its standard
    deviation; `snaps`: the number of snap-throughs that it is estimated from."""

    late_s: float
    sd_s: float
    snaps: int


def displacement_lag(trial: Trial) -> Lag | None:
    """Estimate the lag of a step response or a walk; None if the trial does not determine it."""
    if trial.experiment not in ("step_response", "locomotion") or len(trial.time_s) < 4:
        return None
    from scipy.interpolate import CubicSpline  # slow to import

    time_s, motion = trial.time_s, CubicSpline(trial.time_s, length_mm(trial))
    pressure_psi = trial.columns["pressure_psi" if trial.experiment == "step_response" else "pressure_body_psi"]
    found = [_fit_snap_lag(time_s[k], motion, pressure_psi[k]) for k in _snaps(time_s, motion(time_s, 1))]
    pairs = np.array([pair for pair in found if pair is not None])
    if not len(pairs):
        return None
    late_s, sd_s = pairs.T
    middle_s = float(np.median(late_s))
    scatter_s = 1.4826 * float(np.median(np.abs(late_s - middle_s)))
    return Lag(middle_s, max(scatter_s, float(np.median(sd_s))) / np.sqrt(len(pairs)), len(pairs))


def misfit(lag: Lag, others: Sequence[Lag] = ()) -> str | None:
    """Describe how a trial's lag deviates from that of the session's other trials or, if there are none, from zero;
    None if it fits."""
    if not others:
        return session_misfit([lag])
    usual_s = float(np.median([other.late_s for other in others]))
    if abs(lag.late_s - usual_s) <= max(LIMIT_S, 5.0 * lag.sd_s):
        return None
    return (
        f"the displacement is {_in_words(lag.late_s)} relative to the pressures, but "
        f"{_in_words(usual_s)} in the session's other trials: record this trial again"
    )


def session_misfit(lags: Sequence[Lag]) -> str | None:
    """Describe what is wrong with the lag common to a session's trials; None if nothing is."""
    usual_s = float(np.median([lag.late_s for lag in lags])) if lags else 0.0
    if abs(usual_s) <= LIMIT_OF_ALL_S:
        return None
    return (
        f"the displacement is {_in_words(usual_s)} relative to the pressures: a shift between the instruments, or a "
        "pressure sensor that lags"
    )


def trial_misfit(trial: Trial, earlier: Sequence[Trial]) -> str | None:
    """Describe how a trial's lag deviates from that of `earlier` trials, with its file name; None if it fits."""
    last = displacement_lag(trial)
    if last is None:
        return None
    text = misfit(last, [lag for other in earlier if (lag := displacement_lag(other)) is not None])
    return f"{trial.file}: {text}" if text else None


def _in_words(late_s: float) -> str:
    """A lag in words, such as "8.8 ms early"."""
    return f"{abs(1e3 * late_s):.1f} ms {'late' if late_s > 0.0 else 'early'}"


def length_mm(trial: Trial) -> np.ndarray:
    """Return the length of the actuator in a step response, of the body in a walk, shape (samples,). If only the head
    was tracked, its position is used: in most of the body's snap-throughs only the head moves."""
    columns = trial.columns
    if trial.experiment == "step_response":
        return columns["displacement_mm"]
    return columns["displacement_head_mm"] - columns.get("displacement_tail_mm", 0.0)


def _snaps(time_s: np.ndarray, speed_mm_s: np.ndarray) -> list[slice]:
    """Windows about the snap-throughs, clear of one another and of the ends of the record."""
    sample_s = float(np.median(np.diff(time_s)))
    half, margin = round(_HALF_S / sample_s), round((_HALF_S + REACH_S) / sample_s) + 1
    speed = np.abs(np.convolve(speed_mm_s, np.full(3, 1 / 3), "same"))
    speed[:margin] = speed[max(len(speed) - margin, 0) :] = 0.0
    windows, least = [], _SNAP * speed.max()
    while half > _CURVATURE and (peak := int(np.argmax(speed))) and speed[peak] > max(least, 0.0):
        windows.append(slice(peak - half, peak + half + 1))
        speed[max(peak - 2 * half, 0) : peak + 2 * half + 1] = 0.0
    return windows


def _fit_snap_lag(time_s: np.ndarray, motion: Motion, pressure_psi: np.ndarray) -> tuple[float, float] | None:
    """Least-squares estimate of the lag and its standard deviation [s]; None if the speed does not explain the bump."""
    slow, _ = np.linalg.qr(np.vander(time_s - time_s.mean(), _CURVATURE))
    late_s = np.arange(-REACH_S, REACH_S + _STEP_S / 2, _STEP_S)
    bump = pressure_psi - slow @ (slow.T @ pressure_psi)
    speeds = motion(time_s[:, None] + late_s, 1)
    speeds -= slow @ (slow.T @ speeds)
    gain = (bump @ speeds) / np.maximum((speeds**2).sum(axis=0), 1e-30)
    cost = ((bump[:, None] - gain * speeds) ** 2).sum(axis=0)
    best = int(np.argmin(cost))
    inside = 0 < best < len(late_s) - 1
    if not inside or gain[best] >= 0.0 or cost[best] > (1.0 - _EXPLAINED) * (bump @ bump):
        return None
    before, here, after = cost[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    variance = here / (len(time_s) - _CURVATURE - 2)
    return late_s[best] + 0.5 * _STEP_S * (before - after) / bend, _STEP_S * np.sqrt(2.0 * variance / bend)
