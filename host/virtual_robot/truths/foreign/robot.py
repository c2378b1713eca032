# SPDX-License-Identifier: GPL-3.0-or-later
"""A specimen: another robot of the same design, and a bench with undisclosed constants."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from virtual_robot.errors import VirtualRobotError

# For body and small actuator: stroke between the stable states [m], peaks of the spring [N], and (distance beyond the
# stable state [m], force of the stop there [N]) where full vacuum and full pressure hold it (lab notes, section 6).
_STROKE_M = (0.0537, 0.0300)
_PEAKS_N = ((32.0, 40.0), (7.0, 9.0))
_BEYOND = (((0.0053, 117.0), (0.0042, 76.5)), ((0.0034, 41.6), (0.0033, 27.2)))

Spring = dict[str, float]


class NoSpringError(VirtualRobotError):
    """No truss has these peaks and stops."""


def spring_force(spring: Spring, x: ArrayLike) -> np.ndarray:
    """Force [N] of the truss at `x` [m] from the contracted state; vectorised, for building and for tests."""
    from_truss = np.asarray(x) + spring["zero_m"]
    w = from_truss - spring["rise_m"]
    bar = np.hypot(spring["half_span_m"], w)
    free = np.hypot(spring["half_span_m"], spring["rise_m"])
    hinge = np.arctan2(w, spring["half_span_m"]) - spring["hinge_rest_rad"]
    return (
        2.0 * spring["bar_N_m"] * (bar - free) * w / bar
        + spring["hinge_Nm"] * hinge * spring["half_span_m"] / bar**2
        - spring["stop_in_N"] * np.exp(-from_truss / spring["stop_in_m"])
        + spring["stop_out_N"] * np.exp((from_truss - 2.0 * spring["rise_m"]) / spring["stop_out_m"])
    )


def build_spring(
    stroke_m: float,
    peaks_N: tuple[float, float],
    inward: tuple[float, float],
    outward: tuple[float, float],
    slenderness: float,
    stops_m: tuple[float, float],
) -> Spring:
    """Build the truss with this stroke, these peaks, and (distance [m], force [N]) beyond either stable state.

    `slenderness`: half span over rise; `stops_m`: lengths over which the stops grow e-fold. Damped Newton's
    method in five unknowns. Raises NoSpringError.
    """

    def spring(u: np.ndarray) -> Spring:
        rise = 0.5 * stroke_m * np.exp(u[0])
        rest = 0.8 * np.arctan(1.0 / slenderness)
        made = {
            "half_span_m": slenderness * rise,
            "rise_m": rise,
            "bar_N_m": 10.0 * np.mean(peaks_N) / rise * np.exp(u[1]),
            "hinge_Nm": np.mean(peaks_N) * rise * u[2],
            "hinge_rest_rad": rest,
            "stop_in_N": inward[1] * 0.1 * np.exp(u[3]),
            "stop_in_m": stops_m[0],
            "stop_out_N": outward[1] * 0.15 * np.exp(u[4]),
            "stop_out_m": stops_m[1],
            "zero_m": 0.0,
        }
        roots = _roots(made, stroke_m)
        return made | {"zero_m": roots[0], "unstable_m": roots[1] - roots[0], "extended_m": roots[2] - roots[0]}

    def misses(u: np.ndarray) -> np.ndarray:
        s = spring(u)
        force = _smooth_peaks(spring_force(s, np.linspace(0.0, s["extended_m"], 200)))
        reached = np.array(
            [
                s["extended_m"],
                force[0],
                force[1],
                -spring_force(s, -inward[0]),
                spring_force(s, s["extended_m"] + outward[0]),
            ]
        )
        return reached / np.array([stroke_m, *peaks_N, inward[1], outward[1]]) - 1.0

    u = np.zeros(5)
    for _ in range(60):
        now = misses(u)
        if np.abs(now).max() < 1e-7:
            return {name: float(value) for name, value in spring(u).items()}
        slopes = np.column_stack([(misses(u + 1e-5 * e) - now) / 1e-5 for e in np.eye(5)])
        step = -np.linalg.solve(slopes, now)
        u = u + step * min(1.0, 0.3 / np.abs(step).max())
    raise NoSpringError(f"no truss of slenderness {slenderness:.2f} has peaks {peaks_N} and such stops")


def _smooth_peaks(force: np.ndarray) -> tuple[float, float]:
    """Highest and (negated) lowest force, by the parabola through the three samples around each."""
    peaks = []
    for values in (force, -force):
        k = int(np.clip(np.argmax(values), 1, len(values) - 2))
        before, at, after = values[k - 1 : k + 2]
        peaks.append(float(at - (after - before) ** 2 / (8.0 * (before - 2.0 * at + after))))
    return peaks[0], peaks[1]


def _roots(spring: Spring, stroke_m: float) -> np.ndarray:
    x = np.linspace(-0.2 * stroke_m, 1.3 * stroke_m, 601)
    force = spring_force(spring, x)
    places = np.flatnonzero((force[:-1] < 0) != (force[1:] < 0))
    if len(places) != 3:
        raise NoSpringError("the truss is not bistable")
    low, high = x[places], x[places + 1]
    below = force[places] < 0
    for _ in range(45):
        middle = 0.5 * (low + high)
        same = (spring_force(spring, middle) < 0) == below
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


def draw_robot(random: np.random.Generator) -> dict[str, Any]:
    """Fields of ForeignRobot without any effect; pairs are (body, small actuator)."""

    def around(value: float, spread: float) -> float:
        return value * float(np.exp(spread * random.uniform(-1.0, 1.0)))

    springs = []
    for stroke, peaks, beyond in zip(_STROKE_M, _PEAKS_N, _BEYOND, strict=True):
        (inward, in_N), (outward, out_N) = beyond
        own_stroke = around(stroke, 0.03)
        springs.append(
            build_spring(
                own_stroke,
                (around(peaks[0], 0.12), around(peaks[1], 0.12)),
                (inward, around(in_N, 0.1)),
                (outward, around(out_N, 0.1)),
                float(random.uniform(1.0, 1.7)),
                (own_stroke * float(random.uniform(0.050, 0.060)), own_stroke * float(random.uniform(0.050, 0.060))),
            )
        )
    mu_s = around(0.45, 0.10)
    small_extended = springs[1]["extended_m"]
    return {
        "spring": springs,
        "damping_Ns_m": [around(130.0, 0.2), around(15.0, 0.2)],
        "area_N_psi": [around(9.0, 0.06), around(3.2, 0.06)],
        "alpha_n_per_s": [around(2.0, 0.12), around(2.3, 0.12)],
        "alpha_s_per_s": [around(0.575, 0.12), around(0.8, 0.12)],
        "half_mass_kg": [around(0.175, 0.08), around(0.175, 0.08)],
        "stand_mass_kg": float(random.uniform(0.03, 0.10)),
        "small_mass_kg": float(random.uniform(0.009, 0.022)),
        "segment_mass_kg": float(random.uniform(0.08, 0.13)),
        "wall_offset_m": small_extended - float(random.uniform(0.0017, 0.0028)),
        "wall_N_m": around(8000.0, 0.4),
        "wall_Ns_m": around(20.0, 0.6),
        "mu_s": mu_s,
        "mu_k": mu_s * float(random.uniform(0.78, 0.88)),
        "load_cell_N_m": 5000.0,
        "positive_psi": around(8.5, 0.02),
        "negative_psi": around(-13.0, 0.02),
        "friction_factor": 1.0,
    }
