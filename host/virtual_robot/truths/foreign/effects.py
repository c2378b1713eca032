# SPDX-License-Identifier: GPL-3.0-or-later
"""The foreign effects: what each form changes in the robot (fields of ForeignRobot) and in the bench.

An effect has one or more published forms; the seed draws one, and its other numbers. `size` is the factor of what
the lab notes (section 9) call modest. Sources: docs/truths.md.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from virtual_robot.errors import VirtualRobotError

SIZES = (0.3, 1.0)
PAIR_SIZES = (0.5, 1.0)


class NoEffectError(VirtualRobotError):
    """There is no such effect or form."""


@dataclass(frozen=True)
class Change:
    """What an effect changes: fields of ForeignRobot, and faults of the bench (bench.py)."""

    robot: Mapping[str, Any] = field(default_factory=dict)
    bench: Mapping[str, Any] = field(default_factory=dict)


Form = Callable[[float, np.random.Generator], Change]


@dataclass(frozen=True)
class Effect:
    name: str
    forms: Mapping[str, Form]
    in_library: bool
    remembers: bool = False

    def draw(self, size: float, random: np.random.Generator, form: str | None = None) -> tuple[str, Change]:
        """Return the name of a form, drawn unless given, and what it changes."""
        drawn = str(random.choice(sorted(self.forms)))
        if form is not None and form not in self.forms:
            raise NoEffectError(f"{self.name} has no form {form!r}; there are {', '.join(self.forms)}")
        return form or drawn, self.forms[form or drawn](size, random)


EFFECTS: dict[str, Effect] = {}


def _form(effect: str, name: str, outside: bool = False, remembers: bool = False) -> Callable[[Form], Form]:
    def register(form: Form) -> Form:
        known = EFFECTS.get(effect, Effect(effect, {}, not outside, remembers))
        EFFECTS[effect] = Effect(effect, {**known.forms, name: form}, known.in_library, known.remembers)
        return form

    return register


def _sign(random: np.random.Generator) -> float:
    return float(random.choice((-1.0, 1.0)))


def _between(random: np.random.Generator, low: float, high: float) -> float:
    return float(random.uniform(low, high))


# --- spring -----------------------------------------------------------------------------------------------------


@_form("hysteresis", "bouc_wen")
def _bouc_wen(size: float, random: np.random.Generator) -> Change:
    force = 4.0 * size
    return Change(
        {
            "bouc_N": [force, force * _between(random, 0.18, 0.28)],
            "bouc_m": _between(random, 0.0015, 0.0035),
            "bouc_beta": _between(random, 0.55, 0.8),
            "bouc_power": _between(random, 1.6, 3.0),
        }
    )


@_form("hysteresis", "maxwell_slip")
def _maxwell_slip(size: float, random: np.random.Generator) -> Change:
    force = 4.0 * size
    shares = random.dirichlet(np.full(4, 6.0))
    reach = _between(random, 0.003, 0.006)
    return Change(
        {
            "slip_N": [force, force * _between(random, 0.18, 0.28)],
            "slip_m": [reach * k for k in (0.1, 0.3, 0.6, 1.0)],
            "slip_share": [float(share) for share in shares],
        }
    )


@_form("viscoelasticity", "two_times")
def _two_times(size: float, random: np.random.Generator) -> Change:
    stiffness, share = 170.0 * size, _between(random, 0.35, 0.6)
    return Change(
        {
            "prony_N_m": [stiffness, stiffness * _between(random, 0.3, 0.5)],
            "prony_s": [_between(random, 0.4, 1.2), _between(random, 5.0, 14.0), 0.0, 0.0, 0.0],
            "prony_share": [share, 1.0 - share, 0.0, 0.0, 0.0],
        }
    )


@_form("viscoelasticity", "power_law")
def _power_law(size: float, random: np.random.Generator) -> Change:
    stiffness, power = 220.0 * size, _between(random, 0.15, 0.35)
    times = np.logspace(np.log10(0.12), np.log10(40.0), 5)
    shares = times**-power
    return Change(
        {
            "prony_N_m": [stiffness, stiffness * _between(random, 0.3, 0.5)],
            "prony_s": [float(time) for time in times],
            "prony_share": [float(share) for share in shares / shares.sum()],
        }
    )


@_form("backlash", "prandtl_ishlinskii")
def _plays(size: float, random: np.random.Generator) -> Change:
    radius, spread = 0.5e-3 * size, _between(random, 0.3, 0.6)
    return Change({"play_m": [radius * (1.0 - spread), radius, radius * (1.0 + spread)]})


@_form("backlash", "dead_zone")
def _dead_zone(size: float, random: np.random.Generator) -> Change:
    return Change({"gap_m": 1.0e-3 * size})


@_form("backlash", "loose_marker")
def _loose_marker(size: float, random: np.random.Generator) -> Change:
    return Change(bench={"marker_play_mm": 1.0 * size})


@_form("area_variation", "quadratic")
def _quadratic_area(size: float, random: np.random.Generator) -> Change:
    return Change({"area_slope": _sign(random) * 0.11 * size, "area_form": 0})


@_form("area_variation", "pouch")
def _pouch_area(size: float, random: np.random.Generator) -> Change:
    return Change({"area_slope": _sign(random) * 0.11 * size, "area_form": 1})


# --- valves, lines, supplies --------------------------------------------------------------------------------------


@_form("valve_latency", "jittered")
def _jittered(size: float, random: np.random.Generator) -> Change:
    delays = 0.030 * size * (1.0 + 0.1 * random.uniform(-1.0, 1.0, 3))
    return Change(bench={"delay_s": [[float(d), float(d)] for d in delays], "delay_jitter_s": 0.0015 * size})


@_form("valve_latency", "dead_time_and_opening")
def _opening(size: float, random: np.random.Generator) -> Change:
    opening = _between(random, 0.3, 0.6) * 0.030 * size
    delay = 0.030 * size - 0.5 * opening
    return Change({"opening_s": opening}, {"delay_s": [[delay, delay]] * 3, "delay_jitter_s": 0.0008})


@_form("valve_asymmetry", "two_delays")
def _two_delays(size: float, random: np.random.Generator) -> Change:
    short = _between(random, 0.001, 0.003)
    pairs = []
    late = _sign(random) > 0
    for spread in 1.0 + 0.1 * random.uniform(-1.0, 1.0, 3):
        long = short + 0.030 * size * float(spread)
        pairs.append([long, short] if late else [short, long])
    return Change(bench={"delay_s": pairs, "delay_jitter_s": 0.001})


@_form("line_lag", "delay_and_second_order")
def _delayed_line(size: float, random: np.random.Generator) -> Change:
    share, time = _between(random, 0.15, 0.3), 0.060 * size
    return Change(
        {"line_form": 1, "line_s": (1.0 - share) * time, "line_damping": _between(random, 0.6, 1.0)},
        {"delay_s": [[share * time, share * time]] * 3, "delay_jitter_s": 0.0},
    )


@_form("line_lag", "ladder")
def _ladder(size: float, random: np.random.Generator) -> Change:
    return Change({"line_form": 2, "line_s": 0.060 * size})


@_form("choked_flow", "sonic_conductance")
def _sonic(size: float, random: np.random.Generator) -> Change:
    # At 23.2 psi upstream the greatest rate is twice 1 / (0.045 s/psi), the lab's modest size: a throat also
    # throttles below its critical ratio, and at low pressure upstream it lets less through.
    return Change({"throat_per_s": 44.4 / 23.2 / size, "throat_ratio": _between(random, 0.2, 0.45)})


@_form("choked_flow", "sonic_conductance_by_volume")
def _sonic_by_volume(size: float, random: np.random.Generator) -> Change:
    robot = {"throat_per_s": 44.4 / 23.2 / size, "throat_ratio": _between(random, 0.2, 0.45), "throat_by_volume": 1}
    return Change(robot)


@_form("leak", "orifice")
def _orifice(size: float, random: np.random.Generator) -> Change:
    return Change({"orifice_per_s": 0.05 * size})


@_form("leak", "lip_with_cracking_pressure")
def _lip(size: float, random: np.random.Generator) -> Change:
    return Change({"check_per_s": 0.05 * size, "check_psi": _between(random, 0.5, 1.5)})


@_form("supply_sag", "reservoir")
def _reservoir(size: float, random: np.random.Generator) -> Change:
    recharge = [_between(random, 0.15, 0.6), _between(random, 0.15, 0.6)]
    vacuum = _between(random, 0.7, 1.3)
    shares = [0.03 * size / recharge[0], 0.03 * size * vacuum / recharge[1]]
    return Change({"recharge_s": recharge, "reservoir_share": shares})


@_form("regulator_ripple", "skewed_triangle")
def _triangle(size: float, random: np.random.Generator) -> Change:
    return _ripple(1, 0.3 * size * 1.22, random)  # as much power as the sine


@_form("regulator_ripple", "relay_cycle")
def _relay(size: float, random: np.random.Generator) -> Change:
    return _ripple(2, 0.3 * size * 1.15, random)


def _ripple(form: int, amplitude: float, random: np.random.Generator) -> Change:
    skew = float(random.choice((_between(random, 0.2, 0.35), _between(random, 0.65, 0.8))))
    robot = {"hunt_form": form, "hunt_psi": amplitude, "hunt_Hz": _between(random, 0.3, 0.9), "hunt_skew": skew}
    return Change(robot, {"hunt_wander": 0.01})


# --- sensors --------------------------------------------------------------------------------------------------------


@_form("sensor_lag", "second_order")
def _second_order_sensor(size: float, random: np.random.Generator) -> Change:
    return Change({"sensor_form": 1, "sensor_s": 0.05 * size, "sensor_damping": _between(random, 0.7, 1.2)})


@_form("sensor_lag", "orifice_and_volume")
def _orifice_sensor(size: float, random: np.random.Generator) -> Change:
    return Change({"sensor_form": 2, "sensor_s": 0.05 * size / 2.0})


@_form("sensor_position", "turbulent_drop")
def _turbulent(size: float, random: np.random.Generator) -> Change:
    return Change({"drop_share": 0.05 * size, "drop_power": float(random.choice((1.75, 2.0)))})


@_form("sensor_calibration", "three_sensors_and_a_bend")
def _calibration(size: float, random: np.random.Generator) -> Change:
    sign = _sign(random)
    gain, offset = (sign * s * size * random.uniform(0.75, 1.25, 3) for s in (0.03, 0.2))
    bend = _sign(random) * _between(random, 0.02, 0.06)
    return Change(bench={"gain": gain.tolist(), "offset_psi": offset.tolist(), "bend_psi": bend})


# --- friction, weight, tether ---------------------------------------------------------------------------------------


@_form("stribeck", "lorentz")
def _lorentz(size: float, random: np.random.Generator) -> Change:
    return Change({"stribeck_form": 1, "stribeck_m_s": 0.010 * size})


@_form("stribeck", "tustin")
def _tustin(size: float, random: np.random.Generator) -> Change:
    return Change({"stribeck_form": 2, "stribeck_m_s": 0.010 * size})


@_form("friction_direction", "static_too")
def _both_coefficients(size: float, random: np.random.Generator) -> Change:
    kinetic = _sign(random) * 0.15 * size
    return Change({"direction_kinetic": kinetic, "direction_static": kinetic * _between(random, 0.5, 0.9)})


@_form("friction_direction", "where_pressed_on")
def _where_pressed(size: float, random: np.random.Generator) -> Change:
    share = _sign(random) * 0.16 * size
    return Change({"direction_kinetic": share, "direction_static": share, "direction_wall_only": 1})


@_form("inclination", "sagging_pipe")
def _sagging(size: float, random: np.random.Generator) -> Change:
    angle = _sign(random) * np.deg2rad(10.0) * size
    return Change({"slope_rad": float(angle), "slope_rad_m": float(angle) * _between(random, -0.8, 0.8)})


@_form("tether_drag", "capstan")
def _capstan(size: float, random: np.random.Generator) -> Change:
    length = _between(random, 0.2, 0.4)
    # As much work over the first 0.3 m as 2 N/m does.
    linear, exponential = 0.5 * 2.0 * size * 0.3**2, length * np.expm1(0.3 / length) - 0.3
    return Change({"tether_N": float(linear / exponential), "tether_m": length})


# --- in no library --------------------------------------------------------------------------------------------------


@_form("camera_rings", "kicked_by_valves", outside=True, remembers=True)
def _ringing(size: float, random: np.random.Generator) -> Change:
    ring = {"mm": 1.2 * size, "Hz": _between(random, 3.0, 8.0), "damping": _between(random, 0.015, 0.04)}
    return Change(bench={"camera_ring": ring})


@_form("warming", "damper_thins", outside=True, remembers=True)
def _warming(size: float, random: np.random.Generator) -> Change:
    return Change({"warm_share": 0.35 * size, "warm_s": _between(random, 6.0, 15.0), "warm_W": 0.5})


@_form("pouch_creep", "norton", outside=True, remembers=True)
def _creep(size: float, random: np.random.Generator) -> Change:
    return Change(
        {
            "creep_m_s": 3.0e-5 * size,
            "creep_psi": _between(random, 2.0, 4.0),
            "creep_limit_m": 4.0e-3 * size,
        }
    )


@_form("warm_air", "reduced_order", outside=True, remembers=True)
def _warm_air(size: float, random: np.random.Generator) -> Change:
    return Change({"thermal_share": 0.15 * size, "thermal_s": _between(random, 0.6, 2.0)})


@_form("load_cell_creep", "maxwell", outside=True, remembers=True)
def _cell_creep(size: float, random: np.random.Generator) -> Change:
    return Change(bench={"cell_creep": {"share": 0.05 * size, "time_s": _between(random, 4.0, 12.0)}})


@_form("pipe_bore", "two_waves", outside=True)
def _bore(size: float, random: np.random.Generator) -> Change:
    return Change(
        {
            "bore_m": 0.6e-3 * size,
            "bore_wave_m": [_between(random, 0.12, 0.2), _between(random, 0.03, 0.06)],
            "bore_phase": [float(p) for p in random.uniform(0.0, 2.0 * np.pi, 2)],
        }
    )


@_form("seam", "lip_with_an_edge", outside=True)
def _seam(size: float, random: np.random.Generator) -> Change:
    spacing = _between(random, 0.02, 0.03)
    return Change(
        {
            "seam_rise": 0.6 * size,
            "seam_spacing_m": spacing,
            "seam_width_m": spacing * _between(random, 0.2, 0.4),
            "seam_phase_m": spacing * _between(random, 0.0, 1.0),
        }
    )


@_form("converter_crosstalk", "charge_of_the_channel_before", outside=True)
def _converter(size: float, random: np.random.Generator) -> Change:
    return Change(bench={"converter_share": 0.06 * size})


@_form("camera_latency", "one_marker", outside=True)
def _camera_latency(size: float, random: np.random.Generator) -> Change:
    return Change(bench={"late": {"marker": str(random.choice(("head", "tail"))), "s": 0.045 * size}})


@_form("sensor_warms", "drifting_offset", outside=True)
def _sensor_drift(size: float, random: np.random.Generator) -> Change:
    drift = {"psi": 0.6 * size, "turns": _between(random, 0.6, 1.2), "phase": _between(random, 0.0, 1.0)}
    return Change(bench={"sensor_drift": drift})


@_form("machine_friction", "guide_and_screw", outside=True)
def _machine(size: float, random: np.random.Generator) -> Change:
    machine = {"N": 1.5 * size, "screw_N": 1.0 * size, "lead_m": 0.005, "phase": _between(random, 0.0, 1.0)}
    return Change(bench={"machine": machine})


LIBRARY = tuple(name for name, effect in EFFECTS.items() if effect.in_library)
OUTSIDE = tuple(name for name, effect in EFFECTS.items() if not effect.in_library)
REMEMBERING = tuple(name for name in OUTSIDE if EFFECTS[name].remembers)
