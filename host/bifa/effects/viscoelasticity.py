"""Viscoelasticity of strips and fabric: part of the spring's force relaxes, and the actuator creeps."""

import math

from bifa.effects.effect import EffectParameter, PhysicalEffect

EFFECT = PhysicalEffect(
    name="viscoelasticity",
    summary="part of the spring's force relaxes while it is held, so fast motion meets a stiffer spring",
    equation="K(x) + q,  dq/dt = stiffness_N_m dx/dt - q / time_s  (a Maxwell branch)",
    source="standard linear solid, e.g. W. N. Findley, Creep and Relaxation of Nonlinear Viscoelastic Materials",
    enters="eq. (1), beside K(x), in every actuator",
    experiments=("static_loading", "step_response", "locomotion"),
    parameters=(
        EffectParameter("stiffness_N_m", "N/m", 0.0, 3000.0, 150.0, "of the relaxing branch, body", size=True),
        EffectParameter("time_s", "s", 0.02, 60.0, 4.0, "relaxation time"),
        EffectParameter("small_share", "", 0.0, 1.5, 0.4, "stiffness of a small actuator's branch over the body's"),
    ),
    states=1,
    freed_at=("body_damper",),
)


def spring(stiffness_N_m, time_s, small_share, small, step_s, state):
    """The branch's force at the end of the step: relaxed, plus its growth per velocity. `state` is q of the body."""
    share = small_share if small else 1.0
    relaxed = math.exp(-step_s / time_s)
    return share * state * relaxed, share * stiffness_N_m * time_s * (1.0 - relaxed)


def spring_state(stiffness_N_m, time_s, travel_m, step_s, state):
    """Exact for a constant velocity over the step."""
    relaxed = math.exp(-step_s / time_s)
    return state * relaxed + stiffness_N_m * time_s * (1.0 - relaxed) * travel_m / step_s
