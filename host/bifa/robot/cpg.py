"""The central pattern generator on the host: eq. (9), the thresholds, and the resulting valve commands.

Phases settle at phi_j - phi_i = +psi_ij, so that head and tail run ahead of the body by psi_12 and psi_13. u_i = 1
(positive pressure) when the wrapped phase exceeds 2 pi d_i: a duty is the fraction of the cycle at vacuum.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from bifa.robot.gait import Gait

COUPLING_PER_S = 10.0  # alpha_phi of eq. (9)
CHAMBERS = ("body", "head", "tail")
_STEP_S = 1e-3  # the robot's own time step


def phase_offsets_rad(gait: Gait) -> np.ndarray:
    """Phases of body, head and tail ahead of the body once settled, shape (3,)."""
    return np.radians([0.0, gait.psi12_deg, gait.psi13_deg])


def duties(gait: Gait) -> np.ndarray:
    """Fractions of the cycle at vacuum for body, head and tail, shape (3,)."""
    return np.array([gait.duty_body, gait.duty_head, gait.duty_tail])


def phase_rates(phases_rad: np.ndarray, gait: Gait, coupling_per_s: float = COUPLING_PER_S) -> np.ndarray:
    """Rates in rad/s by eq. (9), shape (3,), for phases (3,)."""
    offsets = phase_offsets_rad(gait)
    psi = offsets[None, :] - offsets[:, None]
    difference = phases_rad[None, :] - phases_rad[:, None] - psi
    return 2.0 * math.pi / gait.period_s + coupling_per_s * np.sin(difference).sum(axis=1)


def outputs(phases_rad: np.ndarray, gait: Gait) -> np.ndarray:
    """The outputs u of section V.A: 1 where the wrapped phase exceeds 2 pi d, else 0."""
    return (np.mod(phases_rad, 2.0 * math.pi) > 2.0 * math.pi * duties(gait)).astype(np.int64)


def phases(
    gait: Gait, time_s: np.ndarray, initial_rad: ArrayLike, coupling_per_s: float = COUPLING_PER_S
) -> np.ndarray:
    """Integrate eq. (9) from `initial_rad` at time 0, by fourth-order Runge-Kutta steps. Returns phases (n, 3) at the
    increasing times `time_s`."""
    time_s = np.asarray(time_s, dtype=float)
    state = np.array(initial_rad, dtype=float)
    result = np.empty((time_s.size, 3))
    now = 0.0
    for i, target in enumerate(time_s):
        for h in _equal_steps(target - now):
            k1 = phase_rates(state, gait, coupling_per_s)
            k2 = phase_rates(state + 0.5 * h * k1, gait, coupling_per_s)
            k3 = phase_rates(state + 0.5 * h * k2, gait, coupling_per_s)
            k4 = phase_rates(state + h * k3, gait, coupling_per_s)
            state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        now = target
        result[i] = state
    return result


def _equal_steps(span_s: float) -> np.ndarray:
    count = max(1, math.ceil(span_s / _STEP_S - 1e-9)) if span_s > 0.0 else 0
    return np.full(count, span_s / max(count, 1))
