"""Displacement and force in a wrong unit, or in each other's columns, found by what else is known of the same motion.

The cross-head's declared speed, the pressure times the area, and the other instrument's stroke each give the scale.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from bifa.check.finding import Finding
from bifa.check.lag import length_mm
from bifa.data import Dataset, Trial
from bifa.robot.parameters import BASE_PARAMETERS

_MM = {"cm": 10.0, "in": 25.4, "m": 1000.0, "um": 1e-3}  # in mm
_N = {"lbf": 4.448222, "kgf": 9.80665, "kN": 1000.0, "mN": 1e-3}  # in N
_SPEED = (0.8, 1.25)  # limits, relative to the declared rate; healthy: 0.99 to 1.01
_OVER_S = 0.5  # interval over which a speed is taken
_AREA = 2.5  # allowed factor outside the plausible range; healthy: within it (1.0), while pounds are off by 4.4
_PRESSED_PSI = 3.0  # from here on area times pressure outweighs the spring in the mean force
_HELD_PSI = 5.0  # from here on an anchor holds
_SNAP_S = 0.06
_SNAP = 0.35  # share of the range covered within _SNAP_S; healthy: 0.5 and more in a snap-through, 0.15 without one
# Relative to the cross-head's stroke. Healthy: 1.1 to 1.5, as vacuum and pressure add.
_MIN_STROKE_RATIO, _MAX_STROKE_RATIO = 0.2, 2.2
_PULL_N = (2.0, 150.0)  # median force of an anchor that holds; healthy: 15 to 31, and 4 if it does not hold
_LONGEST_MM = 200.0  # range of the body's length; healthy: 60 to 70


@dataclass(frozen=True)
class _Kind:
    """A kind of actuator: limits for the ranges of displacement and force in a static loading, far wider than real
    ones."""

    stroke_mm: tuple[float, float]
    force_N: tuple[float, float]
    area: str


_KINDS = {
    "large": _Kind((30.0, 110.0), (28.0, 250.0), "body_area_N_psi"),  # healthy: 52 to 54 mm, 63 to 87 N
    "small": _Kind((15.0, 60.0), (6.5, 60.0), "small_area_N_psi"),  # healthy: 29 to 30 mm, 14 to 20 N
}


def check_units(trial: Trial) -> Iterator[Finding]:
    """Yield a finding for each column that cannot be in the unit of its name."""
    if trial.experiment in ("static_loading", "anchor_pull"):
        yield from _speed(trial)
        yield from _force(trial)
    elif trial.experiment == "locomotion" and "displacement_tail_mm" in trial.columns:
        long_mm = float(np.ptp(length_mm(trial)))
        if long_mm > _LONGEST_MM:
            text = f"the body's length changes by {long_mm:.4g} mm, but only about 60 is possible"
            yield Finding("unit", text + _suggest_unit(long_mm, 60.0, _MM), trial.file, column="displacement_head_mm")


def check_strokes(dataset: Dataset, skipped: Collection[str] = ()) -> Iterator[Finding]:
    """Compare the camera's stroke with the cross-head's for the same actuator. `skipped`: files with a known mistake,
    left out."""
    strokes = {}
    for actuator in _KINDS:
        found = [_stroke_mm(t) for t in dataset.of("static_loading", actuator) if t.file not in skipped]
        if found:
            strokes[actuator] = float(np.median(found))
    for trial in dataset.trials:
        # without a tracked tail a walk shows no length
        walk = "displacement_tail_mm" in trial.columns
        shown = "large" if walk else trial.actuator if trial.experiment == "step_response" else None
        if shown not in strokes or trial.file in skipped:
            continue
        seen_mm = length_mm(trial)
        moved_mm = float(np.ptp(seen_mm))
        share = moved_mm / strokes[shown]
        if share > _MAX_STROKE_RATIO or (share < _MIN_STROKE_RATIO and _snaps(trial.time_s, seen_mm)):
            text = (
                f"moves by {moved_mm:.3g} mm, but by {strokes[shown]:.3g} mm in the testing machine"
                f"{_suggest_unit(moved_mm, 1.2 * strokes[shown], _MM)}"
            )
            yield Finding("unit", text, trial.file, column="displacement_head_mm" if walk else "displacement_mm")


def _snaps(time_s: np.ndarray, seen_mm: np.ndarray) -> bool:
    """Whether much of the motion happens within moments, in whatever unit; filling alone takes a second."""
    step = max(1, round(_SNAP_S / float(np.median(np.diff(time_s)))))
    return bool(np.abs(seen_mm[step:] - seen_mm[:-step]).max(initial=0.0) > _SNAP * np.ptp(seen_mm) > 0.0)


def _stroke_mm(trial: Trial) -> float:
    return float(np.ptp(trial.columns["displacement_mm"]))


def _speed(trial: Trial) -> Iterator[Finding]:
    """A finding if the declared and the measured rate differ, or if the stroke is impossible for the actuator."""
    speed_mm_s = _speed_mm_s(trial)
    low, high = _KINDS[trial.actuator].stroke_mm if trial.actuator else (0.0, np.inf)
    moved_mm = _stroke_mm(trial)
    if speed_mm_s is not None and not _SPEED[0] < speed_mm_s / trial.commanded_mm_s < _SPEED[1]:
        text = (
            f"moves at {speed_mm_s:.3g} mm/s, but rate_mm_s = {trial.rate_mm_s:g}"
            f"{_suggest_unit(speed_mm_s, trial.commanded_mm_s, _MM, 0.1)}"
        )
        yield Finding("unit", text, trial.file, column="displacement_mm")
    elif moved_mm > high or 0.0 < moved_mm < 0.3 * low:  # part of the stroke may have been intended
        text = f"moves by {moved_mm:.3g} mm, but the actuator's stroke is {low:g} to {high:g} mm"
        yield Finding(
            "unit", text + _suggest_unit(moved_mm, 0.5 * (low + high), _MM), trial.file, column="displacement_mm"
        )


def _speed_mm_s(trial: Trial) -> float | None:
    """Median speed during the motion; None if the record is too short or nothing moves."""
    time_s, place_mm = trial.time_s, trial.columns["displacement_mm"]
    step = max(1, round(_OVER_S / float(np.median(np.diff(time_s)))))
    if len(time_s) <= 2 * step:
        return None
    speed = np.abs(place_mm[step:] - place_mm[:-step]) / (time_s[step:] - time_s[:-step])
    return float(np.median(speed[speed >= 0.5 * speed.max()])) if speed.max() > 0.0 else None


def _force(trial: Trial) -> Iterator[Finding]:
    """A finding if the spring's force, area times pressure, or the holding force of an anchor is out of proportion."""
    force_N = trial.columns["force_N"]
    for seen, (low, high), what in _forces(trial, force_N):
        if not low <= seen <= high:
            text = f"{what} {seen:.3g}, but only {low:.3g} to {high:.3g} is possible"
            yield Finding("unit", text + _suggest_unit(seen, np.sqrt(low * high), _N), trial.file, column="force_N")
            return


def _forces(trial: Trial, force_N: np.ndarray) -> Iterator[tuple[float, tuple[float, float], str]]:
    pressed = trial.pressure_psi or 0.0
    if trial.experiment == "anchor_pull":
        if pressed >= _HELD_PSI:
            yield abs(float(np.median(force_N))), _PULL_N, "holding force of the anchor in N:"
        return
    kind = _KINDS[trial.tested]
    whole = _stroke_mm(trial) >= kind.stroke_mm[0]
    if whole:
        yield float(np.ptp(force_N)), kind.force_N, "range from minimum to maximum in N:"
    if whole and abs(pressed) >= _PRESSED_PSI:
        low, high = BASE_PARAMETERS[kind.area].plausible
        area = abs(float(np.mean(force_N)) / pressed)
        yield area, (low / _AREA, high * _AREA), "mean force over pressure in N/psi:"


def _suggest_unit(seen: float, expected: float, units: Mapping[str, float], within: float = 0.5) -> str:
    """The rest of a message: the unit that would make the value plausible, if there is one, and what to do."""
    for unit, size in units.items():
        if abs(np.log(seen * size / expected)) < within if seen > 0.0 else False:
            return f": is it in {unit}? Declare the unit of the export, or multiply by {size:g}"
    return ": check its unit, and that columns are not exchanged"
