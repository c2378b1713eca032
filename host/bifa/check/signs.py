"""Static loadings, anchor pulls and step responses with a column of the wrong sign, without a model of the robot.

A chamber fills while its command is 1 and empties while it is 0, so its pressure goes all the way up and down over the
spans of its own command, less far over those of another chamber, and the opposite way if its sign is reversed.
"""

from collections.abc import Iterator

import numpy as np

from bifa.check.finding import Finding
from bifa.data import Trial

_TRAVEL_MM = 5.0  # smallest travel that reaches the stable ends
_ENDS = ((0.0, 0.05), (0.15, 0.25), (0.75, 0.85), (0.95, 1.0))  # as shares of the travel
_MIN_RISE = -0.05  # share of the force's range, at both ends; healthy: +0.15 or more at one end, +0.28 at the other
_MAX_REVERSED_RATIO = 2.0  # ratio of the extremes on the wrong and on the right side; healthy: less than 0.1
# Share of its range by which a reversed quantity follows the command. Healthy: 0.92 and more for a pressure, 0.53 and
# more for a displacement.
MAX_REVERSED_SHARE = -0.5
PORTS = "but should rise: are the sensor's two ports exchanged? Reverse the sign"
_MOVES_MM = 5.0  # smallest reversed motion that counts; small actuators have a stroke of 30 mm


def check_static_loading(trial: Trial) -> Iterator[Finding]:
    """Check the signs of a static loading. At either stable end an actuator resists motion both ways, whatever the
    pressure: K rises there, and so does the force."""
    mm, force_N = trial.columns["displacement_mm"], trial.columns["force_N"]
    if -mm.min() > max(_TRAVEL_MM, _MAX_REVERSED_RATIO * mm.max()):
        text = (
            f"goes down to {mm.min():.1f} mm, but should go up: displacement is positive when extending; "
            "reverse its sign"
        )
        yield Finding("sign", text, trial.file, column="displacement_mm")
        return
    if mm.max() < _TRAVEL_MM:
        return
    means = [_mean(force_N[(mm >= low * mm.max()) & (mm <= high * mm.max())]) for low, high in _ENDS]
    first, last = means[1] - means[0], means[3] - means[2]
    limit = _MIN_RISE * np.ptp(force_N)
    if first < limit and last < limit:
        text = (
            f"falls by {-first:.2f} N over the first fifth of the travel and by {-last:.2f} N over the last, but "
            "pulling an actuator out of a stable state takes a rising force: is pushing counted as positive? "
            "Positive is pulling; reverse the sign"
        )
        yield Finding("sign", text, trial.file, column="force_N")


def check_anchor_pull(trial: Trial) -> Iterator[Finding]:
    """Check the sign of an anchor pull: an anchor resists, so its force is positive, whichever way the head is
    pulled."""
    force_N = trial.columns["force_N"]
    if np.median(force_N) < 0.0 and -force_N.min() > _MAX_REVERSED_RATIO * force_N.max():
        text = (
            f"the median is {np.median(force_N):.2f} N, but a resistance is positive: does the load cell "
            "count the other way? Reverse the sign"
        )
        yield Finding("sign", text, trial.file, column="force_N")


def check_step_response(trial: Trial) -> Iterator[Finding]:
    """Check the signs of a step response: while the command is 1, a chamber fills and its actuator extends."""
    command, time_s = trial.columns["command"], trial.time_s
    share = follow(command, trial.columns["pressure_psi"], time_s)
    moved_mm = swing(command, trial.columns["displacement_mm"], time_s)
    if share is None or moved_mm is None:
        return
    falls, shrinks = share < MAX_REVERSED_SHARE, moved_mm < -_MOVES_MM
    if falls and shrinks:
        text = (
            f"while it is 1, the pressure falls and the displacement shrinks by {-moved_mm:.1f} mm: 1 is positive "
            "pressure, 0 vacuum; exchange them"
        )
        yield Finding("sign", text, trial.file, column="command")
    elif falls:
        psi = -(swing(command, trial.columns["pressure_psi"], time_s) or 0.0)
        text = f"falls by {psi:.2f} psi while the command is positive, {PORTS}"
        yield Finding("sign", text, trial.file, column="pressure_psi")
    elif shrinks:
        text = (
            f"shrinks by {-moved_mm:.1f} mm while the actuator is inflated: displacement is positive when extending; "
            "reverse its sign"
        )
        yield Finding("sign", text, trial.file, column="displacement_mm")


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if values.size else np.nan


def swing(command: np.ndarray, values: np.ndarray, time_s: np.ndarray) -> float | None:
    """Return by how much `values` rise while the command is 1 and fall while it is 0: the mean over spans between
    switches.

    All arguments have shape (samples,). Only whole cycles count (if there is one), and steady drift over them is
    removed (a robot that slides down a slope). None if the command never switches.
    """
    at = np.flatnonzero(np.diff(command))
    if not at.size:
        return None
    if at.size == 1:
        at = np.append(at, len(command) - 1)
    whole = (at.size - 1) // 2 * 2
    drift = 0.0
    if whole:
        at = at[: whole + 1]
        drift = (values[at[-1]] - values[at[0]]) / (time_s[at[-1]] - time_s[at[0]])
    change = np.diff(values[at]) - drift * np.diff(time_s[at])
    return float(np.mean(np.where(command[at[:-1] + 1] > 0.5, change, -change)))


def follow(command: np.ndarray, values: np.ndarray, time_s: np.ndarray) -> float | None:
    """Return `swing` as a share of the values' range, -1 to 1; None if the command or the values never change."""
    span, travel = float(np.ptp(values)), swing(command, values, time_s)
    return None if travel is None or span == 0.0 else travel / span
