"""How late is a trial's displacement against its pressures? What the two instruments themselves say, without a model.

A pressure is (F - b v) / a (paper, section III.A): each snap-through shows in it as a bump in the shape of the speed,
some 7 psi high and a few samples wide, on a force F that changes slowly. The shift of the displacement at which its
derivative explains the bump best is the lag: to some 0.2 ms from trial to trial, to 1 ms as such.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bifa.data import Trial

Motion = Callable[..., np.ndarray]  # (time_s, derivative's order) -> mm/s, as SciPy's splines

LIMIT_S = 3e-3  # between trials: a third of a sample; what a robot does in them shifts it by less than 1 ms
LIMIT_OF_ALL_S = 9e-3  # a pressure sensor's own filter may well take 8 ms; a whole sample is 10
REACH_S = 0.04  # lags looked for
_HALF_S = 0.12  # of the window about a snap-through
_STEP_S = 1e-3
_SNAP = 0.4  # of the greatest speed: slower motion is no snap-through
_EXPLAINED = 0.9  # of the bump's variance, else the window tells nothing
_CURVATURE = 3  # columns of the slow force: a parabola over the window


@dataclass(frozen=True)
class Lag:
    """`late_s`: by how much the displacement is late against the pressure, negative where it is early; `sd_s` its
    scatter as a standard deviation; `snaps`: the snap-throughs that it rests on."""

    late_s: float
    sd_s: float
    snaps: int


def displacement_lag(trial: Trial) -> Lag | None:
    """The lag of a step response or a walk; None where nothing in the trial tells it."""
    if trial.experiment not in ("step_response", "locomotion") or len(trial.time_s) < 4:
        return None
    from scipy.interpolate import CubicSpline  # slow to import

    time_s, motion = trial.time_s, CubicSpline(trial.time_s, length_mm(trial))
    pressure_psi = trial.columns["pressure_psi" if trial.experiment == "step_response" else "pressure_body_psi"]
    found = [_of_snap(time_s[k], motion, pressure_psi[k]) for k in _snaps(time_s, motion(time_s, 1))]
    pairs = np.array([pair for pair in found if pair is not None])
    if not len(pairs):
        return None
    late_s, sd_s = pairs.T
    middle_s = float(np.median(late_s))
    scatter_s = 1.4826 * float(np.median(np.abs(late_s - middle_s)))
    return Lag(middle_s, max(scatter_s, float(np.median(sd_s))) / np.sqrt(len(pairs)), len(pairs))


def misfit(lag: Lag, others: Sequence[Lag] = ()) -> str | None:
    """What is wrong with a trial's lag compared with the session's other trials or, if there are none, with no lag
    at all; None if it fits."""
    if not others:
        return shift_of_all([lag])
    usual_s = float(np.median([other.late_s for other in others]))
    if abs(lag.late_s - usual_s) <= max(LIMIT_S, 5.0 * lag.sd_s):
        return None
    return (
        f"the displacement is {_in_words(lag.late_s)} relative to the pressures, in the session's other "
        f"trials {_in_words(usual_s)}: record this trial again"
    )


def shift_of_all(lags: Sequence[Lag]) -> str | None:
    """What is wrong with the lag that a session's trials have in common, if anything is."""
    usual_s = float(np.median([lag.late_s for lag in lags])) if lags else 0.0
    if abs(usual_s) <= LIMIT_OF_ALL_S:
        return None
    return (
        f"the displacement is {_in_words(usual_s)} relative to the pressures: a shift between the instruments, or a "
        "pressure sensor that lags"
    )


def misfit_of(trial: Trial, earlier: Sequence[Trial]) -> str | None:
    """What is wrong with a trial's lag compared with `earlier` ones, with its file."""
    last = displacement_lag(trial)
    if last is None:
        return None
    text = misfit(last, [lag for other in earlier if (lag := displacement_lag(other)) is not None])
    return f"{trial.file}: {text}" if text else None


def _in_words(late_s: float) -> str:
    """In words, such as "8.8 ms early"."""
    return f"{abs(1e3 * late_s):.1f} ms {'late' if late_s > 0.0 else 'early'}"


def length_mm(trial: Trial) -> np.ndarray:
    """Of the actuator in a step response, of the body in a walk, (samples,); where only the head was tracked, its
    position: it alone moves in most of a body's snaps."""
    columns = trial.columns
    if trial.experiment == "step_response":
        return columns["displacement_mm"]
    return columns["displacement_head_mm"] - columns.get("displacement_tail_mm", 0.0)


def _snaps(time_s: np.ndarray, speed_mm_s: np.ndarray) -> list[slice]:
    """Windows about the snap-throughs, apart from one another and from the ends of the record."""
    sample_s = float(np.median(np.diff(time_s)))
    half, margin = round(_HALF_S / sample_s), round((_HALF_S + REACH_S) / sample_s) + 1
    speed = np.abs(np.convolve(speed_mm_s, np.full(3, 1 / 3), "same"))
    speed[:margin] = speed[max(len(speed) - margin, 0) :] = 0.0
    windows, least = [], _SNAP * speed.max()
    while half > _CURVATURE and (peak := int(np.argmax(speed))) and speed[peak] > max(least, 0.0):
        windows.append(slice(peak - half, peak + half + 1))
        speed[max(peak - 2 * half, 0) : peak + 2 * half + 1] = 0.0
    return windows


def _of_snap(time_s: np.ndarray, motion: Motion, pressure_psi: np.ndarray) -> tuple[float, float] | None:
    """Lag and standard deviation [s] by least squares over the lag; None where speed does not explain the bump."""
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
