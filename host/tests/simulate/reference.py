"""An independent solution of eq. (1)-(8): event-driven, for comparison with the simulator. Slow and exact.

Nothing of `bifa.simulate` is used. Between events the equations are smooth and are integrated by Dormand and Prince's
5(4) pair; each event (an end starts or stops sliding, an actuator meets or leaves the wall, passes x_th) is found by
bisection of the step in which it lies, and switches the right-hand side.
"""

import math

import numpy as np
from numba import njit
from scipy.integrate import RK45

GRAVITY = 9.80665
_A = np.vstack([np.pad(RK45.A, ((0, 0), (0, 1))), RK45.B])  # Dormand and Prince (1980); the last stage is the result
_E = RK45.E
_SCALE = np.array([1.0, 100.0, 1.0, 100.0, 1e3, 1.0, 100.0, 1e3, 1.0, 100.0, 1e3])  # m, m/s, N over metres
# Modes: sliding of head and tail, wall contact of head and tail, bulge (alpha_s) of body, head, tail
SLIDE_H, SLIDE_T, WALL_H, WALL_T, BULGE_B, BULGE_H, BULGE_T = range(7)


def constants(model):
    """Constants of a model as flat arrays: numbers, and the two polynomials with their ends."""
    v = model.values
    body, small = model.body_stiffness, model.small_stiffness
    numbers = np.array(
        [
            v["head_mass_kg"], v["tail_mass_kg"], v["body_damping_Ns_m"], v["body_area_N_psi"],
            v["body_alpha_n_per_s"], v["body_alpha_s_per_s"], body.unstable_m, v["small_mass_kg"],
            v["small_damping_Ns_m"], v["small_area_N_psi"], v["small_alpha_n_per_s"], v["small_alpha_s_per_s"],
            small.unstable_m, v["wall_offset_m"], v["wall_stiffness_N_m"], v["wall_damping_Ns_m"], v["mu_s"], v["mu_k"],
            v["supply_positive_psi"], v["supply_negative_psi"], body.contracted_m, small.contracted_m,
        ]
    )  # fmt: skip
    curves = [np.array([c.lower_m, c.upper_m, *c.coefficients]) for c in (body, small)]
    return numbers, curves[0], curves[1]


@njit
def spring(curve, x):
    inside = min(max(x, curve[0]), curve[1])
    z = 2.0 * (inside - curve[0]) / (curve[1] - curve[0]) - 1.0
    force, slope = 0.0, 0.0
    for i in range(curve.size - 1, 1, -1):
        slope = slope * z + force
        force = force * z + curve[i]
    return force + slope * 2.0 / (curve[1] - curve[0]) * (x - inside)


@njit
def normal(c, s, mode, end):
    x, v = s[5 + 3 * end], s[6 + 3 * end]
    wall = c[14] * (x - c[13]) + c[15] * v if mode[WALL_H + end] else 0.0
    return 3.0 * wall + c[end] * GRAVITY


@njit
def pushes(c, body, s):
    """Forces on head and tail without friction."""
    pull = -spring(body, s[0] - s[2]) - c[2] * (s[1] - s[3]) + s[4]
    return pull, -pull


@njit
def rates(c, body, small, s, mode, command, out):
    q_h, q_t = pushes(c, body, s)
    out[0], out[2] = s[1], s[3]
    out[1] = (q_h - mode[SLIDE_H] * c[17] * normal(c, s, mode, 0)) / c[0] if mode[SLIDE_H] else 0.0
    out[3] = (q_t - mode[SLIDE_T] * c[17] * normal(c, s, mode, 1)) / c[1] if mode[SLIDE_T] else 0.0
    for i in range(3):
        source = c[18] if command[i] == 1 else (c[19] if command[i] == 0 else 0.0)
        at = 4 if i == 0 else 4 + 3 * i
        area, fast, slow = (c[3], c[4], c[5]) if i == 0 else (c[9], c[10], c[11])
        alpha = slow if mode[BULGE_B + i] and source < 0.0 else fast
        out[at] = alpha * (source * area - s[at])
    for end in range(2):
        at = 5 + 3 * end
        wall = (normal(c, s, mode, end) - c[end] * GRAVITY) / 3.0
        out[at] = s[at + 1]
        out[at + 1] = (-spring(small, s[at]) - c[8] * s[at + 1] + s[at + 2] - wall) / c[7]


@njit
def violated(c, body, s, mode):
    """Index of the first condition of the mode that no longer holds, -1 if all do."""
    q_h, q_t = pushes(c, body, s)
    for end in range(2):
        v, q = (s[1], q_h) if end == 0 else (s[3], q_t)
        slide = mode[SLIDE_H + end]
        if slide and slide * v < 0.0:
            return SLIDE_H + end
        if not slide and abs(q) > c[16] * normal(c, s, mode, end):
            return SLIDE_H + end
        x, u = s[5 + 3 * end], s[6 + 3 * end]
        touching = x > c[13] and c[14] * (x - c[13]) + c[15] * u > 0.0
        if touching != (mode[WALL_H + end] == 1):
            return WALL_H + end
        if (x > c[12]) != (mode[BULGE_H + end] == 1):
            return BULGE_H + end
    if (s[0] - s[2] > c[6]) != (mode[BULGE_B] == 1):
        return BULGE_B
    return -1


@njit
def switch(c, body, s, mode, which):
    if which > SLIDE_T:
        mode[which] = 1 - mode[which]
        return
    q = pushes(c, body, s)[which]
    v = 1 + 2 * which
    if mode[which] and abs(q) <= c[16] * normal(c, s, mode, which):
        mode[which] = 0
    else:
        mode[which] = 1 if q > 0.0 else -1
    s[v] = 0.0


@njit
def trial_step(c, body, small, s, mode, command, h, k, new):
    """One Dormand-Prince step into `new`; returns its error estimate relative to the scales."""
    stage = np.empty(s.size)
    for j in range(7):
        stage[:] = s
        for i in range(j):
            stage += h * _A[j, i] * k[i]
        rates(c, body, small, stage, mode, command, k[j])
    new[:] = stage
    error = 0.0
    for i in range(s.size):
        e = 0.0
        for j in range(7):
            e += _E[j] * k[j, i]
        error = max(error, abs(h * e) / _SCALE[i])
    return error


@njit
def advance(c, body, small, s, mode, command, now, until, tolerance):
    """Integrate `s`, `mode` in place to `until`; returns the number of events."""
    k = np.empty((7, s.size))
    new = np.empty(s.size)
    h, events = 1e-5, 0
    while until - now > 1e-13:
        h = min(h, until - now)
        error = trial_step(c, body, small, s, mode, command, h, k, new)
        if error > tolerance:
            h *= max(0.2, 0.9 * (tolerance / error) ** 0.2)
            continue
        which = violated(c, body, new, mode)
        if which < 0:
            s[:] = new
            now += h
            h *= min(4.0, 0.9 * (tolerance / max(error, 1e-30)) ** 0.2)
            continue
        low, high = 0.0, h
        while high - low > 1e-13:
            middle = 0.5 * (low + high)
            trial_step(c, body, small, s, mode, command, middle, k, new)
            if violated(c, body, new, mode) < 0:
                low = middle
            else:
                high = middle
        trial_step(c, body, small, s, mode, command, high, k, new)
        s[:] = new
        now += high
        which = violated(c, body, s, mode)
        while which >= 0:
            switch(c, body, s, mode, which)
            events += 1
            which = violated(c, body, s, mode)
        h = 1e-5
    return events


def settled_switches(gait, duration_s):
    """Switches [(time, chamber, command)] as defined in section V.A: phases psi apart, the body's 0 at time 0."""
    first, later = [], []
    ahead = (0.0, gait.psi12_deg, gait.psi13_deg)
    for i, duty in enumerate((gait.duty_body, gait.duty_head, gait.duty_tail)):
        start = (ahead[i] / 360.0) % 1.0
        first.append((0.0, i, int(start > duty)))
        for cycle in range(math.ceil(duration_s / gait.period_s) + 2):
            later.append(((cycle - start + duty) * gait.period_s, i, 1))
            later.append(((cycle - start) * gait.period_s, i, 0))
    return first + sorted(switch for switch in later if 0.0 < switch[0] < duration_s)


def walk(model, gait, sample_s, tolerance=1e-12):
    """(n, 11) states at rising times: x_h v_h x_t v_t F_b, then x v F of the head's and the tail's small actuator."""
    c, body, small = constants(model)
    s = np.zeros(11)
    s[0], s[5], s[8] = c[20], c[21], c[21]
    mode = np.zeros(7, np.int64)
    command = np.full(3, 2)
    pending = settled_switches(gait, sample_s[-1])
    now, rows = 0.0, []
    for sample in sample_s:
        while pending and pending[0][0] <= sample:
            time, chamber, value = pending.pop(0)
            advance(c, body, small, s, mode, command, now, time, tolerance)
            now = max(now, time)
            command[chamber] = value
        advance(c, body, small, s, mode, command, now, sample, tolerance)
        now = sample
        rows.append(s.copy())
    return np.array(rows)
