"""A motor that turns a load through a shaft: torque in, the load's angle out.

Model: two inertias, a damped spring between them, damping at the load. Sources of the truth's forms: Dahl's bristles
(1968); drag with an exponent of 1.75; a gap whose flanks are soft and damped; cogging with a second harmonic; an
unbalance with one as well; an amplifier with a rounded limit, and of second order; friction whose viscous part depends
on the direction, too.
"""

import numpy as np

from benchmarks.small.integrate import rate, read
from benchmarks.small.kind import Form, Kind
from benchmarks.small.kinds.forms import dahl, rounded_limit
from lacuna import Effect, Parameter

SLOTS, SHAFT_NMS = 6.0, 0.3
PARAMETERS = (
    Parameter("motor_kg_m2", "kg m^2", 0.02, 0.004, 0.1),
    Parameter("load_kg_m2", "kg m^2", 0.05, 0.01, 0.25),
    Parameter("shaft_Nm_rad", "N m/rad", 13.0, 3.0, 60.0),
    Parameter("damping_Nms_rad", "N m s/rad", 0.06, 0.01, 0.4),
)
EFFECTS = (
    Effect("coulomb", Parameter("torque_Nm", "N m", 0.04, 0.0, 0.4)),
    Effect("windage", Parameter("drag_Nms2", "N m s^2", 0.01, 0.0, 0.1)),
    Effect("backlash", Parameter("gap_rad", "rad", 0.1, 0.0, 1.5)),
    Effect("cogging", Parameter("torque_Nm", "N m", 0.05, -0.4, 0.4)),
    Effect("unbalance", Parameter("torque_Nm", "N m", 0.08, -1.0, 1.0)),
    Effect("torque_limit", Parameter("limit_Nm", "N m", 0.35, 0.05, np.inf), absent=np.inf),
    Effect("amplifier_delay", Parameter("delay_s", "s", 0.03, 0.0, 0.3)),
    Effect("one_sided_friction", Parameter("torque_Nm", "N m", 0.03, -0.3, 0.3)),
)


@rate
def _rates(t, x, u, p, dx):
    motor, load, shaft, damping, coulomb, windage, gap, cogging, unbalance, limit, one_sided = (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[11],
    )  # fmt: skip
    twist = x[0] - x[2]
    beyond = twist - min(max(twist, -0.5 * gap), 0.5 * gap)
    through = shaft * beyond + (SHAFT_NMS * (x[1] - x[3]) if beyond != 0.0 or gap == 0.0 else 0.0)
    speed = x[3]
    friction = damping * speed + coulomb * np.tanh(speed / 0.05) + windage * np.abs(speed) * speed
    friction += one_sided * 0.5 * (1.0 + np.tanh(speed / 0.05))
    driven = min(max(u, -limit), limit)
    dx[0], dx[2] = x[1], x[3]
    dx[1] = (driven - cogging * np.sin(SLOTS * x[0]) - through) / motor
    dx[3] = (through - friction - unbalance * np.sin(x[2])) / load


@read
def _reading(t, x, u, p):
    return x[2]


TRUE_OFF = {
    "bristle_Nm": 0.0, "turbulent": 0.0, "play_rad": 0.0, "slot_Nm": 0.0, "eccentric_Nm": 0.0,
    "rounded_limit_Nm": np.inf, "stages_s": 0.0, "forward_Nm": 0.0,
}  # fmt: skip


@rate
def _true_rates(t, x, u, p, dx):
    motor, load, shaft, damping, bristle, turbulent, play, slot, eccentric, limit, stages, forward = (
        p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11],
    )  # fmt: skip
    ahead, speed, driven = x[0] - x[2], x[3], u
    for k in range(2):  # x[5], x[6]: the amplifier
        dx[5 + k] = 2.0 * (driven - x[5 + k]) / stages if stages > 0.0 else 0.0
        driven = x[5 + k] if stages > 0.0 else driven
    transmitted = shaft * ahead + SHAFT_NMS * (x[1] - speed)
    if play > 0.0:  # flanks that are soft over a few hundredths of the gap, and damp while they touch
        corner = 0.02 * play
        on = corner * np.log1p(np.exp(min((ahead - 0.5 * play) / corner, 40.0)))
        off = corner * np.log1p(np.exp(min((-ahead - 0.5 * play) / corner, 40.0)))
        touching = (on + off) / (on + off + corner)
        transmitted = shaft * (on - off) + SHAFT_NMS * touching * (x[1] - speed)
    dx[4] = dahl(speed, x[4], bristle, 0.01)
    friction = damping * speed + x[4] + turbulent * np.abs(speed) ** 0.75 * speed
    if forward != 0.0 and speed > 0.0:
        friction += forward * (1.0 - np.exp(-speed / 0.1)) * (1.0 + 0.04 * speed)
    cogging = slot * (np.sin(SLOTS * x[0]) + 0.2 * np.sin(2.0 * SLOTS * x[0]))
    dx[0], dx[2] = x[1], x[3]
    dx[1] = (rounded_limit(driven, limit) - cogging - transmitted) / motor
    weight = eccentric * (np.sin(x[2]) + 0.1 * np.sin(2.0 * x[2]))
    dx[3] = (transmitted - friction - weight) / load


KIND = Kind(
    key="drive",
    name="motor and load",
    output="angle_rad",
    input="torque_Nm",
    parameters=PARAMETERS,
    effects=EFFECTS,
    rates=_rates,
    reading=_reading,
    states=4,
    forms=(
        Form("coulomb", "Dahl's bristles", {"bristle_Nm": (0.015, 0.1)}),
        Form("windage", "exponent of 1.75", {"turbulent": (0.004, 0.03)}),
        Form("backlash", "soft, damped flanks", {"play_rad": (0.03, 0.2)}),
        Form("cogging", "with a second harmonic", {"slot_Nm": (0.02, 0.12)}),
        Form("unbalance", "with a second harmonic", {"eccentric_Nm": (0.03, 0.2)}),
        Form("torque_limit", "rounded corner", {"rounded_limit_Nm": (0.2, 0.4)}),
        Form("amplifier_delay", "second order", {"stages_s": (0.02, 0.08)}),
        Form("one_sided_friction", "rises with speed", {"forward_Nm": (0.015, 0.08)}),
    ),
    true_off=TRUE_OFF,
    true_rates=_true_rates,
    true_reading=_reading,
    true_states=7,
    duration_s=8.0,
    samples=320,
    sizes=(0.25, 0.5),
    judged=(0.35, 0.6),
    steps=2,
    delay="amplifier_delay",
)  # fmt: skip
