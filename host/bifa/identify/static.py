"""First stage: stiffness K and area a from static loading (paper, IV.A.1)."""

from dataclasses import dataclass

import numpy as np

from bifa.data import Dataset, Trial
from bifa.problem.motion import imposed_motion
from bifa.problem.stiffness import StiffnessFit, UndeterminedError, fit_stiffness

UNPRESSURISED_PSI = 0.05  # below this commanded pressure a trial counts as one at 0 psi


@dataclass(frozen=True)
class StaticFit:
    """Result of static loading for one actuator. `area_N_psi`: None if every trial was at 0 psi; `hysteresis_N`: half
    the mean distance between the loading and the unloading branch at 0 psi."""

    actuator: str
    stiffness: StiffnessFit
    area_N_psi: float | None
    hysteresis_N: float


def fit_static(dataset: Dataset, actuator: str, reach_m: tuple[float, float] | None = None) -> StaticFit:
    """Fit K at 0 psi through the middle of the hysteresis, then the area that brings the other pressures onto it.
    `reach_m`: the range in other experiments. Raises UndeterminedError if there is no trial at 0 psi."""
    trials = dataset.of("static_loading", actuator)
    unloaded = [trial for trial in trials if abs(trial.commanded_psi) < UNPRESSURISED_PSI]
    if not unloaded:
        raise UndeterminedError(
            f"the stiffness curve of the {actuator} actuator cannot be determined: it has no static_loading at "
            f"0 psi; run `bifa experiment static_loading --actuator {actuator}`"
        )
    x, force, loading = (np.concatenate(parts) for parts in zip(*map(_branches, unloaded), strict=True))
    stiffness = fit_stiffness(x, force, loading, reach_m=reach_m)
    pressurised = [trial for trial in trials if trial not in unloaded]
    area = _area(stiffness, pressurised) if pressurised else None
    return StaticFit(actuator, stiffness, area, _half_width(x, force, loading, stiffness))


def _branches(trial: Trial) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement [m], force [N], and whether the actuator was being extended; pauses are left out."""
    motion = imposed_motion(trial.time_s, trial.columns["displacement_mm"] * 1e-3)
    moving = motion.direction != 0
    return motion.displacement_m[moving], trial.columns["force_N"][moving], motion.direction[moving] > 0


def _area(stiffness: StiffnessFit, trials: list[Trial]) -> float:
    """Each trial gives one area, the mean of (K(x) - F) / p; higher pressures have more weight."""
    areas, weights = [], []
    for trial in trials:
        x, force, _ = _branches(trial)
        areas.append(np.mean(stiffness.force(x) - force) / trial.commanded_psi)
        weights.append(trial.commanded_psi**2)
    return float(np.average(areas, weights=weights))


def _half_width(x: np.ndarray, force: np.ndarray, loading: np.ndarray, stiffness: StiffnessFit) -> float:
    """Half of (mean residual loading - mean residual unloading), away from the ends where the direction turns."""
    low, high = stiffness.covered_m
    middle = (x > low + 0.1 * (high - low)) & (x < high - 0.1 * (high - low))
    if not (loading & middle).any() or not (~loading & middle).any():
        return 0.0
    residual = force - stiffness.force(x)
    return 0.5 * float(residual[loading & middle].mean() - residual[~loading & middle].mean())
