"""An independent laboratory for the tests: another stiffness curve, another integrator, coloured noise.

Written from the paper's equations (1)-(8), not from the model's code: the curve is a von Mises truss with stiffening
ends instead of a sine-like polynomial, forces are stepped explicitly at 20 us with friction as an impulse bound, the
steps of a single actuator are integrated by SciPy, and every channel carries autoregressive noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from bifa import robot
from bifa.data import Dataset, Trial

G = 9.81
STEP_S = 2e-5


@njit(cache=True)
def truss(x, scale, stroke, depth, skew, end):
    """Force [N] of a snap-through truss: zero at 0 and `stroke`, unstable between, `end` [N] stiffens the ends."""
    y0 = 0.5 * stroke
    y = x - y0
    length = np.sqrt(y0 * y0 + depth * depth)
    force = -scale * y * (length / np.sqrt(y * y + depth * depth) - 1.0) * (1.0 + skew * y / y0)
    return force + end * ((y / y0) ** 9 - y / y0)


@dataclass(frozen=True)
class Actuator:
    curve: tuple[float, float, float, float, float]
    mass: float
    damping: float
    area: float
    fast: float
    slow: float

    def spring(self, x):
        return truss(float(x), *self.curve)

    @property
    def unstable(self):
        stroke = self.curve[1]
        return brentq(self.spring, 0.2 * stroke, 0.8 * stroke)


@dataclass(frozen=True)
class IndependentLab:
    large: Actuator = Actuator((4900.0, 0.0520, 0.0200, 0.10, 15.0), 0.175, 118.0, 8.6, 2.3, 0.66)
    small: Actuator = Actuator((1800.0, 0.0290, 0.0110, 0.08, 3.5), 0.015, 13.0, 3.05, 2.6, 0.9)
    head_mass: float = 0.180
    tail_mass: float = 0.170
    segment_mass: float = 0.100
    wall_offset: float = 0.0268
    wall_stiffness: float = 8000.0
    wall_damping: float = 20.0
    mu_s: float = 0.48
    mu_k: float = 0.40
    positive: float = 8.5
    negative: float = -13.0
    force_noise: float = 0.12
    displacement_noise_mm: float = 0.05
    pressure_noise: float = 0.03
    color: float = 0.5
    friction_wobble: float = 0.0
    seed: int = 0
    rng: np.random.Generator = field(default=None, compare=False)

    def with_seed(self, seed: int) -> IndependentLab:
        return replace(self, seed=seed, rng=np.random.default_rng(seed))

    def noise(self, n: int, sd: float) -> np.ndarray:
        """Autoregressive noise of standard deviation `sd`."""
        white = self.rng.standard_normal(n + 50)
        out = np.empty(n + 50)
        out[0] = white[0]
        for i in range(1, n + 50):
            out[i] = self.color * out[i - 1] + np.sqrt(1 - self.color**2) * white[i]
        return sd * out[50:]

    @property
    def truth(self) -> dict[str, float]:
        """The values of the parameters that experiments determine, under the model's names."""
        return {
            "body_damping_Ns_m": self.large.damping,
            "body_area_N_psi": self.large.area,
            "body_alpha_n_per_s": self.large.fast,
            "body_alpha_s_per_s": self.large.slow,
            "small_damping_Ns_m": self.small.damping,
            "small_area_N_psi": self.small.area,
            "small_alpha_n_per_s": self.small.fast,
            "small_alpha_s_per_s": self.small.slow,
            "wall_offset_m": self.wall_offset,
            "mu_s": self.mu_s,
            "mu_k": self.mu_k,
        }

    def sensor(self, pressure: np.ndarray) -> np.ndarray:
        """Readings after noise and a converter with 0.0366 psi per count."""
        noisy = pressure + self.noise(len(pressure), self.pressure_noise)
        return np.round(noisy / (30 / 819)) * (30 / 819)

    def static(self, which: str, pressure: float, rate_mm_s: float = 2.0, **labels) -> Trial:
        actuator: Actuator = getattr(self, which)
        stroke = actuator.curve[1]
        half = stroke / (rate_mm_s * 1e-3)
        time = np.arange(0.0, 2 * half, 0.02)
        x = np.where(time < half, time, 2 * half - time) * rate_mm_s * 1e-3
        force = np.array([actuator.spring(v) for v in x]) - actuator.area * pressure
        columns = {
            "time_s": time,
            "displacement_mm": x * 1e3 + 0.002 * self.rng.standard_normal(len(x)),
            "force_N": force + self.noise(len(x), self.force_noise),
            "pressure_psi": self.sensor(np.full(len(x), pressure)),
        }
        return Trial(
            "", "static_loading", columns, actuator=which, pressure_psi=pressure, rate_mm_s=rate_mm_s, **labels
        )

    def step(self, which: str, pressure: float, **labels) -> Trial:
        """A step response: vacuum until settled, positive supply from 0.5 s, vacuum again from 3.5 to 8 s."""
        time, x, sensed = _clean_step(getattr(self, which), self.negative, pressure)
        columns = {
            "time_s": time,
            "command": ((time >= 0.5) & (time < 3.5)).astype(float),
            "displacement_mm": x * 1e3 + self.noise(len(time), self.displacement_noise_mm),
            "pressure_psi": self.sensor(sensed),
        }
        return Trial("", "step_response", columns, which, pressure, **labels)

    def anchor(self, pressure: float, rate_mm_s: float = 20.0, **labels) -> Trial:
        """A quasi-static pull: the load cell's force rises to static friction, then the head slides."""
        actuator = self.small

        def balance(x):
            wall = max(0.0, self.wall_stiffness * (x - self.wall_offset))
            return actuator.spring(x) + wall - actuator.area * pressure

        x = brentq(balance, 0.8 * actuator.curve[1], 1.6 * actuator.curve[1])
        normal = 3 * max(0.0, self.wall_stiffness * (x - self.wall_offset)) + self.segment_mass * G
        normal *= 1 + self.friction_wobble * self.rng.standard_normal()
        time = np.arange(0.0, 2.0, 0.02)
        pulled = rate_mm_s * 1e-3 * time
        force = 5000.0 * pulled
        sliding = force > self.mu_s * normal
        force = np.where(sliding, self.mu_k * normal, force)
        columns = {
            "time_s": time,
            "displacement_mm": pulled * 1e3 + 0.002 * self.rng.standard_normal(len(time)),
            "force_N": force + self.noise(len(time), self.force_noise),
            "pressure_psi": self.sensor(np.full(len(time), pressure)),
        }
        return Trial("", "anchor_pull", columns, pressure_psi=pressure, rate_mm_s=rate_mm_s, **labels)

    def walk(self, gait: dict[str, float], duration_s: float = 20.0, **labels) -> Trial:
        """A walk; the phases start where eq. (9) settles, the body's at 0."""
        time = np.arange(0.0, duration_s, 0.01)
        phases = np.array([0.0, gait["psi12_deg"], gait["psi13_deg"]]) / 360.0
        duties = np.array([gait["duty_body"], gait["duty_head"], gait["duty_tail"]])
        wobble = 1 + self.friction_wobble * self.rng.standard_normal()
        large, small = self.large, self.small
        out = _walk(
            duration_s,
            gait["period_s"],
            phases,
            duties,
            (large.damping, large.area, large.fast, large.slow, large.unstable),
            large.curve,
            (small.mass, small.damping, small.area, small.fast, small.slow, small.unstable),
            small.curve,
            (self.head_mass, self.tail_mass, self.wall_offset, self.wall_stiffness, self.wall_damping),
            (self.mu_s * wobble, self.mu_k * wobble, self.positive, self.negative),
        )
        command = ((time[:, None] / gait["period_s"] + phases) % 1.0 > duties).astype(float)
        n = len(time)
        columns = {"time_s": time}
        for i, chamber in enumerate(("body", "head", "tail")):
            columns[f"command_{chamber}"] = command[:, i]
            columns[f"pressure_{chamber}_psi"] = self.sensor(out[2 + i, :n])
        columns["displacement_head_mm"] = out[0, :n] * 1e3 + self.noise(n, self.displacement_noise_mm)
        columns["displacement_tail_mm"] = out[1, :n] * 1e3 + self.noise(n, self.displacement_noise_mm)
        return Trial("", "locomotion", columns, gait=gait, **labels)

    def day(self, name: str, trials: Sequence[Trial], path: Path | None = None) -> Dataset:
        """A data set of `trials`, in the order in which they were measured."""
        known = {"head_mass_kg": self.head_mass, "tail_mass_kg": self.tail_mass}
        known |= {"supply_positive_psi": self.positive, "supply_negative_psi": self.negative}
        trials = tuple(replace(t, file=f"{i:03d}_{t.experiment}.csv", session_order=i) for i, t in enumerate(trials))
        return Dataset(path=path, name=name, known=known, trials=trials)


BASELINE = robot.BASELINE.as_dict()


def session(lab: IndependentLab, path: Path | None, repeats: int = 3, walks: int = 2) -> Dataset:
    """A day at the bench: both actuators at three pressures, steps at two, pulls at three, walks."""
    trials = []
    for repeat in range(1, repeats + 1):
        for which in ("large", "small"):
            trials += [lab.static(which, p, repeat=repeat) for p in (0.0, 4.0, 8.0)]
            trials += [lab.step(which, p, repeat=repeat) for p in (6.5, 8.5)]
        trials += [lab.anchor(p, repeat=repeat) for p in (0.0, 4.0, 8.5)]
    trials += [lab.walk(BASELINE, repeat=repeat) for repeat in range(1, walks + 1)]
    return lab.day("independent laboratory", trials, path)


def small_session(lab: IndependentLab) -> Dataset:
    """A short session, for fast tests: two repeats of the experiments needed to determine every parameter."""
    trials = []
    for repeat in (1, 2):
        for which in ("large", "small"):
            trials += [lab.static(which, p, rate_mm_s=4.0, repeat=repeat) for p in (0.0, 8.0)]
            trials += [lab.step(which, p, repeat=repeat) for p in (6.5, 8.5)]
        trials += [lab.anchor(p, repeat=repeat) for p in (0.0, 4.0, 8.5)]
        trials += [lab.walk(BASELINE, 12.0, repeat=repeat)]
    return lab.day("small session", trials)


@lru_cache(maxsize=64)
def _clean_step(actuator: Actuator, negative: float, pressure: float):
    """Time [s], displacement [m] and pressure [psi] of a step response without noise."""
    threshold = actuator.unstable
    rest = brentq(lambda x: actuator.spring(x) - actuator.area * negative, -0.02, 1e-3)

    def rates(supply):
        def f(_, s):
            x, v, force = s
            alpha = actuator.slow if x > threshold and supply < 0 else actuator.fast
            return (
                v,
                (force - actuator.spring(x) - actuator.damping * v) / actuator.mass,
                alpha * (actuator.area * supply - force),
            )

        return f

    def passes(_, s):
        return s[0] - threshold

    passes.terminal = True
    passes.direction = -1
    time = np.arange(0.0, 8.0, 0.01)
    state = np.array([rest, 0.0, actuator.area * negative])
    out = np.empty((3, len(time)))
    out[:, time <= 0.5] = state[:, None]
    now = 0.5
    for end, supply in ((3.5, pressure), (8.0, negative)):
        while now < end - 1e-12:
            piece = solve_ivp(
                rates(supply), (now, end), state, "Radau", rtol=1e-8, atol=1e-10, dense_output=True, events=passes
            )
            until = piece.t[-1]
            inside = (time > now + 1e-12) & (time <= until + 1e-12)
            out[:, inside] = piece.sol(np.minimum(time[inside], until))
            state, now = piece.y[:, -1].copy(), until
            if piece.status == 1:
                state[0] -= 1e-12
    x, v, force = out
    return time, x, (force - actuator.damping * v) / actuator.area


@njit(cache=True)
def _friction(velocity, force, mass, normal, mu_s, mu_k):
    """Velocity after a step in which friction opposes the motion with an impulse of at most mu N h."""
    free = velocity + STEP_S * force / mass
    most = STEP_S * (mu_s if velocity == 0.0 else mu_k) * normal / mass
    if abs(free) <= most:
        return 0.0
    most = STEP_S * mu_k * normal / mass
    return free - most if free > 0.0 else free + most


@njit(cache=True)
def _walk(duration, period, phases, duties, body, body_curve, limb, limb_curve, robot, surface):
    b, a, fast, slow, threshold = body
    m_a, b_a, a_a, fast_a, slow_a, threshold_a = limb
    m_h, m_t, x_w, k_w, b_w = robot
    mu_s, mu_k, positive, negative = surface
    steps = round(duration / STEP_S)
    every = round(0.01 / STEP_S)
    out = np.zeros((5, steps // every + 1))
    x, v = np.zeros(2), np.zeros(2)  # head, tail
    y, w = np.zeros(2), np.zeros(2)  # their actuators
    force, force_a = 0.0, np.zeros(2)
    normal = np.zeros(2)
    for i in range(steps):
        if i % every == 0:
            j = i // every
            out[0, j], out[1, j] = x[0], x[1]
            out[2, j] = (force - b * (v[0] - v[1])) / a
            for s in range(2):
                out[3 + s, j] = (force_a[s] - b_a * w[s]) / a_a
        t = i * STEP_S
        stretch = x[0] - x[1]
        u = (t / period + phases[0]) % 1.0 > duties[0]
        supply = positive if u else negative
        alpha = slow if (stretch > threshold and supply < 0) else fast
        force += STEP_S * alpha * (a * supply - force)
        for s in range(2):
            u = (t / period + phases[1 + s]) % 1.0 > duties[1 + s]
            supply = positive if u else negative
            alpha = slow_a if (y[s] > threshold_a and supply < 0) else fast_a
            force_a[s] += STEP_S * alpha * (a_a * supply - force_a[s])
            wall = 0.0
            if y[s] > x_w:
                wall = max(0.0, k_w * (y[s] - x_w) + b_w * w[s])
            spring = truss(y[s], limb_curve[0], limb_curve[1], limb_curve[2], limb_curve[3], limb_curve[4])
            w[s] += STEP_S * (force_a[s] - spring - b_a * w[s] - wall) / m_a
            y[s] += STEP_S * w[s]
            normal[s] = 3 * wall
        pull = force - b * (v[0] - v[1])
        pull -= truss(stretch, body_curve[0], body_curve[1], body_curve[2], body_curve[3], body_curve[4])
        v[0] = _friction(v[0], pull, m_h, normal[0] + m_h * 9.81, mu_s, mu_k)
        v[1] = _friction(v[1], -pull, m_t, normal[1] + m_t * 9.81, mu_s, mu_k)
        x += STEP_S * v
    return out
