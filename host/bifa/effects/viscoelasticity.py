"""Viscoelasticity of strips and fabric: part of the spring's force relaxes, and the actuator creeps."""

import math

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="viscoelasticity",
    summary="part of the spring's force relaxes when it is held, so a fast motion meets a stiffer spring",
    equation="K(x) + q,  dq/dt = stiffness_N_m dx/dt - q / time_s  (a Maxwell branch)",
    source="standard linear solid, e.g. W. N. Findley, Creep and Relaxation of Nonlinear Viscoelastic Materials",
    enters="eq. (1), beside K(x), in every actuator",
    experiments=("static_loading", "step_response", "locomotion"),
    parameters=(
        EffectParameter("stiffness_N_m", "N/m", 0.0, 3000.0, 150.0, "stiffness of the body's branch", size=True),
        EffectParameter("time_s", "s", 0.02, 60.0, 4.0, "relaxation time"),
        EffectParameter("small_share", "", 0.0, 1.5, 0.4, "stiffness of a small actuator's branch over the body's"),
    ),
    states=1,
    freed_at=("body_damper",),
)


def spring(stiffness_N_m, time_s, small_share, small, step_s, state):
    """The branch's relaxed force at the end of the step, and its growth per unit velocity. `state` is q, for the body's
    stiffness."""
    share = small_share if small else 1.0
    relaxed = math.exp(-step_s / time_s)
    return share * state * relaxed, share * stiffness_N_m * time_s * (1.0 - relaxed)


def spring_state(stiffness_N_m, time_s, travel_m, step_s, state):
    """State q after the step, exact for a constant velocity."""
    relaxed = math.exp(-step_s / time_s)
    return state * relaxed + stiffness_N_m * time_s * (1.0 - relaxed) * travel_m / step_s
