"""The central pattern generator on the host: eq. (9), thresholds, and the valve switches they give.

Phases settle at phi_j - phi_i = +psi_ij, so head and tail run ahead of the body by psi_12 and psi_13, and
u_i = 1 (positive pressure) when the wrapped phase exceeds 2 pi d_i: a duty is the part of the cycle at vacuum.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from bifa.robot.gait import Gait

COUPLING_PER_S = 10.0  # alpha_phi of eq. (9)
CHAMBERS = ("body", "head", "tail")
_STEP_S = 1e-3  # the robot's own rate


def phase_offsets_rad(gait: Gait) -> np.ndarray:
    """(3,) phase of body, head, tail ahead of the body once settled."""
    return np.radians([0.0, gait.psi12_deg, gait.psi13_deg])


def duties(gait: Gait) -> np.ndarray:
    """(3,) vacuum fractions of body, head, tail."""
    return np.array([gait.duty_body, gait.duty_head, gait.duty_tail])


def phase_rates(phases_rad: np.ndarray, gait: Gait, coupling_per_s: float = COUPLING_PER_S) -> np.ndarray:
    """Eq. (9): (3,) rates in rad/s for (3,) phases."""
    offsets = phase_offsets_rad(gait)
    psi = offsets[None, :] - offsets[:, None]
    difference = phases_rad[None, :] - phases_rad[:, None] - psi
    return 2.0 * math.pi / gait.period_s + coupling_per_s * np.sin(difference).sum(axis=1)


def outputs(phases_rad: np.ndarray, gait: Gait) -> np.ndarray:
    """u of section V.A: 1 where the wrapped phase exceeds 2 pi d, else 0."""
    return (np.mod(phases_rad, 2.0 * math.pi) > 2.0 * math.pi * duties(gait)).astype(np.int64)


def phases(
    gait: Gait, time_s: np.ndarray, initial_rad: ArrayLike, coupling_per_s: float = COUPLING_PER_S
) -> np.ndarray:
    """(n, 3) phases at increasing times from `initial_rad` at time 0: eq. (9) by fourth-order Runge-Kutta steps."""
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
