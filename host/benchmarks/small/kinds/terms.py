"""The kinds whose models are sums of terms of measured quantities, for sparse regression."""

import numpy as np

from benchmarks.systems.problem import Terms

TERMS = {
    "thermal": Terms(
        {
            "capacity_J_K": lambda x, u: u,
            "conductance_W_K": lambda x, u: x,
            "steeper_loss.loss_W_K2": lambda x, u: np.abs(x) * x,
            "heater_drift.drift_1_K": lambda x, u: u * x,
        },
        inertia="capacity_J_K",
        inputs=("power_W",),
        order=1,
        unit=1.0,
    ),
    "oscillator": Terms(
        {
            "mass_kg": lambda x, v, u: u,
            "stiffness_N_m": lambda x, v, u: x,
            "damping_Ns_m": lambda x, v, u: v,
            "coulomb.force_N": lambda x, v, u: np.tanh(v / 5e-3),
            "cubic_spring.stiffness_N_m3": lambda x, v, u: x**3,
            "quadratic_drag.drag_Ns2_m2": lambda x, v, u: np.abs(v) * v,
        },
        inertia="mass_kg",
        inputs=("force_N",),
    ),
}
