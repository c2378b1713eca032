"""Speed of evaluating a gait: the simulator against the paper's way, SciPy's LSODA with a Python right-hand side.

Same model, same gaits, same four cycles, same run. The paper's eq. (5) needs a speed threshold, which it does not
state. At 1e-2 m/s LSODA finishes, but the baseline's speed is 50 % too high; at 1e-3 m/s it comes within 10 % of the
right speed (at 1e-4 within 1 %) and often does not finish. Both are reported. The claim is made for 1e-3 m/s, since a
wrong answer is no evaluation, and for the gaits that LSODA finishes, since for the others the ratio depends on when it
was stopped. Times are processor times, so that other load on the machine counts for neither side.
"""

import math
import time
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from bifa import robot, simulate
from bifa.robot import Gait, Model, StiffnessCurve

CYCLES = 4
THRESHOLDS_M_S = (1e-2, 1e-3)
LONGEST_S = 40.0  # LSODA is stopped after this time
GAITS = (
    robot.BASELINE,
    Gait(2.516, 208.9, 331.9, 0.649, 0.4425, 0.4425),  # near the fastest
    Gait(3.4, 208.9, 331.9, 0.649, 0.4425, 0.4425),
)
SETTLED_CYCLES = 16
SEARCHING_M, FINE_M, VERIFYING_M = 1e-5, 1e-6, 1e-7  # tolerances of the integrator per step
_GRAVITY = 9.80665


def run() -> dict[str, float]:
    """Print the comparison; return `gait_evaluation_speedup`, `gait_evaluations_per_second` and more."""
    model = robot.nominal()
    rows = simulate.gait_rows(GAITS)
    simulate.speeds(model, rows, CYCLES)  # compiled, or read from the cache
    ours = simulate.speeds(model, rows, CYCLES).speed_mm_s
    crude, theirs = (
        np.array([_papers_time(model, gait, e, speed) for gait, speed in zip(GAITS, ours, strict=True)])
        for e in THRESHOLDS_M_S
    )
    each = np.array([_our_time(model, row) for row in rows])
    ended = theirs < LONGEST_S
    speedup = float(theirs[ended].sum() / each[ended].sum())
    batch = np.vstack([_like(row) for row in rows])
    single, alone = _timed(lambda: simulate.speeds(model, batch, CYCLES, workers=1))
    together, both = _timed(lambda: simulate.speeds(model, batch, CYCLES))
    single, alone, together, both = (seconds / len(batch) for seconds in (single, alone, together, both))
    settled, transient = (
        [reference_error(model, rows, cycles, step) for step in (SEARCHING_M, FINE_M)]
        for cycles in (SETTLED_CYCLES, CYCLES)
    )
    print(f"one gait, {CYCLES} cycles, bifa, one core, in lanes with others: {alone * 1e3:8.3f} ms")
    cores = simulate.cores()
    print(f"evaluations per second, one core {1 / alone:.0f}; {cores} cores {1 / together:.0f} with what else ran")
    print(
        f"{cores} threads over one: {single / together:.2f} times as fast by the clock; "
        f"by the processor's time {cores * alone / both:.2f}, what threads cost each other"
    )
    print(
        f"ratio on one core, the {np.count_nonzero(ended)} gaits that LSODA finished: {speedup:.0f} (required: 20000); "
        f"all, those stopped at {LONGEST_S:.0f} s: {theirs.sum() / each.sum():.0f}; "
        f"to the threshold of 1e-2 m/s, wrong by half: {crude.sum() / each.sum():.0f}"
    )
    for what, (coarse, fine) in (("once settled", settled), (f"in cycle {CYCLES}, one gait in transient", transient)):
        print(f"advance {what} against the verifying step: searching within {coarse:.3%}, predicting within {fine:.3%}")
    return {
        "gait_evaluation_speedup": speedup,
        "gait_evaluation_speedup_with_stopped": float(theirs.sum() / each.sum()),
        "gait_evaluation_speedup_crude_threshold": float(crude.sum() / each.sum()),
        "gait_evaluations_per_second": 1.0 / together,
        "gait_evaluations_per_second_one_core": 1.0 / alone,
        "gait_evaluation_lsoda_s": float(theirs[ended].mean()),
        "gait_evaluation_core_scaling": single / together,
        "gait_evaluation_core_scaling_processor": cores * alone / both,
        "gait_settled_error_searching": settled[0],
        "gait_settled_error_predicting": settled[1],
        "gait_transient_error_searching": transient[0],
        "gait_transient_error_predicting": transient[1],
    }


def _papers_time(model: Model, gait: Gait, threshold_m_s: float, ours_mm_s: float) -> float:
    start = time.process_time()
    try:
        said = f"{1e3 * papers_way(model, gait, threshold_m_s) / gait.period_s:.1f} mm/s"
    except TimeoutError:
        said = "stopped"
    seconds = time.process_time() - start
    print(f"LSODA, threshold {threshold_m_s:g} m/s, gait of {gait.period_s:g} s: {seconds:.1f} s, {said}", end="")
    print(f" (without a threshold: {ours_mm_s:.1f} mm/s)", flush=True)
    return seconds


def _our_time(model: Model, row: np.ndarray) -> float:
    rows = _like(row)
    return _timed(lambda: simulate.speeds(model, rows, CYCLES, workers=1))[1] / len(rows)


def _like(row: np.ndarray, count: int = 200) -> np.ndarray:
    """Gaits within a thousandth of a gait `row`, since equal ones would share every step of the integrator."""
    return row * np.random.default_rng(0).uniform(0.999, 1.001, (count, len(row)))


def _timed(job) -> tuple[float, float]:
    """Wall-clock and processor seconds."""
    clock, used = time.perf_counter(), time.process_time()
    job()
    return time.perf_counter() - clock, time.process_time() - used


def reference_error(model: Model, rows: np.ndarray, cycles: int, tolerance_m: float) -> float:
    """Largest relative error over the gaits of the advance in the last of `cycles`, against the verifying step."""
    found = simulate.speeds(model, rows, cycles, tolerance_m).advance_m[:, -1]
    fine = simulate.speeds(model, rows, cycles, VERIFYING_M).advance_m[:, -1]
    return float(np.max(np.abs(found / fine - 1.0)))


def papers_way(model: Model, gait: Gait, threshold_m_s: float) -> float:
    """Eq. (1)-(8) as written, by LSODA between valve switches: advance in the last cycle, m. Raises TimeoutError."""
    right_hand_side = _RightHandSide(model, threshold_m_s)
    switches = simulate.of_gait(gait, CYCLES * gait.period_s)
    last = (CYCLES - 1) * gait.period_s
    times = np.unique([*switches.time_s, last, CYCLES * gait.period_s])
    before = 0.0
    state = np.zeros(11)
    state[0] = model.body_stiffness.contracted_m
    state[5] = state[8] = model.small_stiffness.contracted_m
    for start, end in pairwise(times):
        commands = switches.at([start])[0]
        supplies = (model["supply_negative_psi"], model["supply_positive_psi"], 0.0)
        right_hand_side.supply = [supplies[command] for command in commands]
        if start == last:
            before = state[0]
        state = solve_ivp(right_hand_side, (start, end), state, method="LSODA").y[:, -1]
    return state[0] - before


class _Spring:
    """K(x) by `np.polyval`, linear outside its range."""

    def __init__(self, curve: StiffnessCurve):
        self.lower, self.upper, self.threshold = curve.lower_m, curve.upper_m, curve.unstable_m
        self.coefficients = curve.coefficients[::-1]
        self.slope_lower, self.slope_upper = float(curve.slope(self.lower)), float(curve.slope(self.upper))

    def __call__(self, x):
        inside = min(max(x, self.lower), self.upper)
        force = np.polyval(self.coefficients, 2.0 * (inside - self.lower) / (self.upper - self.lower) - 1.0)
        return force + (self.slope_lower if x < self.lower else self.slope_upper) * (x - inside)


class _RightHandSide:
    """Plain Python, written straight from the paper."""

    def __init__(self, model: Model, threshold_m_s: float):
        self.threshold = threshold_m_s
        self.value = model.values
        self.body, self.small = _Spring(model.body_stiffness), _Spring(model.small_stiffness)
        self.deadline = time.process_time() + LONGEST_S
        self.supply = [0.0, 0.0, 0.0]

    def __call__(self, _time, y):
        if time.process_time() > self.deadline:
            raise TimeoutError
        v = self.value
        x_h, v_h, x_t, v_t, f_b = y[:5]
        pull = -self.body(x_h - x_t) - v["body_damping_Ns_m"] * (v_h - v_t) + f_b
        rates = [v_h, 0.0, v_t, 0.0, self._filling("body", self.body, 0, x_h - x_t, f_b)]
        for end, (mass, push, speed) in enumerate(((v["head_mass_kg"], pull, v_h), (v["tail_mass_kg"], -pull, v_t))):
            x, u, f = y[5 + 3 * end : 8 + 3 * end]
            wall = 0.0
            if x > v["wall_offset_m"]:
                wall = max(v["wall_stiffness_N_m"] * (x - v["wall_offset_m"]) + v["wall_damping_Ns_m"] * u, 0.0)
            normal = 3.0 * wall + mass * _GRAVITY
            if abs(speed) > self.threshold:
                friction = math.copysign(v["mu_k"] * normal, speed)
            else:
                friction = math.copysign(min(v["mu_s"] * normal, abs(push)), push)
            rates[1 + 2 * end] = (push - friction) / mass
            force = -self.small(x) - v["small_damping_Ns_m"] * u + f - wall
            rates += [u, force / v["small_mass_kg"], self._filling("small", self.small, 1 + end, x, f)]
        return rates

    def _filling(self, name, curve, chamber, x, force):
        supply = self.supply[chamber]
        slow = x > curve.threshold and supply < 0.0
        alpha = self.value[f"{name}_alpha_s_per_s" if slow else f"{name}_alpha_n_per_s"]
        return alpha * (supply * self.value[f"{name}_area_N_psi"] - force)
