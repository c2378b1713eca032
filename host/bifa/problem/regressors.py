"""Regressors: named quantities at every sample of a trial on which a residual may depend."""

import numpy as np

from bifa.problem.inputs import PullInputs, StaticInputs, StepInputs, WalkInputs
from bifa.ranges import CHAMBERS
from bifa.simulate import Timeline
from lacuna.system import Channels, Record

_RESTING_MM_S = 0.2


def of(trial: Record, prediction: Channels) -> dict[str, np.ndarray]:
    """Regressors of a trial, each of shape (n,)."""
    named = {"time": trial.time_s - trial.time_s[0]}
    if trial.session_order is not None:
        named["place in the session"] = np.full(trial.time_s.shape, float(trial.session_order))
    inputs = trial.payload
    match inputs:
        case StaticInputs():
            named["displacement"] = inputs.displacement_m * 1e3
            named["direction of motion"] = inputs.direction.astype(float)
            named["pressure"] = np.full(trial.time_s.shape, inputs.pressure_psi)
        case StepInputs():
            named["displacement"] = prediction["displacement_mm"]
            named |= _motion(prediction["displacement_mm"], trial.time_s)
            named["pressure"] = prediction["pressure_psi"]
            named |= _switching(inputs.commands, inputs.time_s, 0, "")
        case PullInputs():
            named["pulled distance"] = inputs.pulled_s * abs(inputs.rate_mm_s)
            named["direction of motion"] = np.full(trial.time_s.shape, np.sign(inputs.rate_mm_s))
            named["pressure"] = np.full(trial.time_s.shape, inputs.pressure_psi)
        case WalkInputs():
            named["position in the pipe"] = prediction["displacement_head_mm"]
            named |= _motion(prediction["displacement_head_mm"], trial.time_s)
            for i, chamber in enumerate(CHAMBERS):
                named[f"pressure of the {chamber}"] = prediction[f"pressure_{chamber}_psi"]
                named |= _switching(inputs.commands, inputs.time_s, i, f" of the {chamber}")
    return named


def _motion(displacement_mm: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    velocity_mm_s = np.gradient(displacement_mm, time_s)
    direction = np.where(np.abs(velocity_mm_s) > _RESTING_MM_S, np.sign(velocity_mm_s), 0.0)
    return {"velocity": velocity_mm_s, "direction of motion": direction}


def _switching(commands: Timeline, time_s: np.ndarray, chamber: int, suffix: str) -> dict[str, np.ndarray]:
    mine = commands.chamber == chamber
    times, states = commands.time_s[mine], commands.command[mine]
    last = np.clip(np.searchsorted(times, time_s, side="right") - 1, 0, None)
    return {
        f"command{suffix}": states[last].astype(float),
        f"time since the last switch{suffix}": time_s - times[last],
    }
