"""One step of the robot, or of one actuator on its stand, by eq. (1)-(8) with linearly implicit velocities.

Friction (5) is set-valued Coulomb friction. An end at rest has exactly zero velocity and stays at rest while the force
on it is at most mu_s N; a sliding end meets mu_k N and comes to exact rest when its velocity would change sign. (With
the paper's eq. (5), an end creeps below the speed threshold; see docs/model.md.)
"""

import math
from typing import NamedTuple

import numpy as np

from bifa.robot.model import GRAVITY_M_S2
from bifa.simulate import layout, learnt
from bifa.simulate.actuator import area_at, convergence, pressure_after, pressure_moved, remember, resistance
from bifa.simulate.compiled import inner, merged
from bifa.simulate.hooks import chains
from bifa.simulate.learnt import learnt_at

# State y: positions in m, velocities in m/s, pressures in psi.
X_HEAD, V_HEAD, X_TAIL, V_TAIL, P_BODY, X_SMALL_HEAD, V_SMALL_HEAD, P_HEAD, X_SMALL_TAIL, V_SMALL_TAIL, P_TAIL = range(
    11
)
STATES = 11
# Parts of the robot that are present
HAS_BODY, HAS_HEAD, HAS_TAIL = 1, 2, 4
# Commands for a chamber
VACUUM, POSITIVE, OFF = 0, 1, 2

_WALL_COUNT = 3.0  # eq. (7): three actuators per segment
_LEAST_GROWTH = 0.05  # share of the damping below which a step is too long for the falling part of K
_ALIKE = 1e-9  # difference in excess over the hold, relative to both holds, below which two ends count as equal
TOO_LONG = -1


class Mounting(NamedTuple):
    """How the robot, or a part of it, is mounted and supplied.

    `parts`: HAS_ bits. `free` = 1: the body's smaller end moves freely and the other is clamped (step response).
    `wall` = 0: no pipe around the small actuators. `looser`: factor on the tolerance of their states, 1 if their
    pressures are read. `terrain`: see `bifa.simulate.terrain`; empty for a clear pipe. `share`: (3,) volumes of the
    body, head and tail chambers, as seen by a supply, over the body's.
    """

    parts: int
    free: int
    wall: int
    looser: float
    incline_rad: float
    positive_psi: float
    negative_psi: float
    share: np.ndarray
    terrain: np.ndarray


@merged
def gravity_of(plant, rig, gravity):
    """Write gravity along the pipe (downhill) and against its wall, m/s^2, into `gravity` (2,). Stands are level."""
    incline = rig.incline_rad
    if not rig.free:
        incline += chains.incline(plant.active, plant.q)
    gravity[0], gravity[1] = GRAVITY_M_S2 * math.sin(incline), GRAVITY_M_S2 * math.cos(incline)


@merged
def sources(plant, rig, command, y, now, source):
    """Write the pressure that the valves supply to each chamber, p_d of eq. (2), into `source` (3,)."""
    q, active = plant.q, plant.active
    positive, negative = rig.positive_psi, rig.negative_psi
    if active & chains.SUPPLY:
        positive = chains.supply(active, q, positive, now)
    if active & chains.LOAD:
        positive = _loaded(plant, rig, command, y, POSITIVE, positive)
        negative = _loaded(plant, rig, command, y, VACUUM, negative)
    for i in range(3):
        source[i] = positive if command[i] == POSITIVE else (negative if command[i] == VACUUM else 0.0)


@merged
def _loaded(plant, rig, command, y, which, supply):
    conductance = 0.0
    pull = 0.0
    for i in range(3):
        if command[i] == which and rig.parts & (1 << i):
            block = layout.BODY if i == 0 else layout.SMALL
            x = y[X_HEAD] - y[X_TAIL] if i == 0 else y[X_SMALL_HEAD + 3 * (i - 1)]
            alpha = rig.share[i] * convergence(plant.q, block, x, supply)
            conductance += alpha
            pull += alpha * y[P_BODY + 3 * i]
    return chains.load(plant.active, plant.q, supply, conductance, pull, which == POSITIVE)


@inner
def step(plant, rig, gravity, source, y, z, h, y_new, z_new):
    """Advance `y`, `z` by `h` into `y_new`, `z_new`.

    Returns a number that identifies the kind of step (which ends slide, which actuators touch the wall, which alpha
    applies), or TOO_LONG. `source`: (3,) psi; `gravity`: (2,) from `gravity_of`.
    """
    kind = 0
    if plant.active:
        for i in range(z.size):
            z_new[i] = z[i]
    stable = True
    if rig.parts & HAS_HEAD:
        mode = _small(plant, rig, 1, source[1], y, z, h, y_new, z_new, squeeze(rig.terrain, 5, y[X_HEAD]))
        stable = stable and mode != TOO_LONG
        kind = 8 * kind + mode
    if rig.parts & HAS_TAIL:
        mode = _small(plant, rig, 2, source[2], y, z, h, y_new, z_new, squeeze(rig.terrain, 6, y[X_TAIL]))
        stable = stable and mode != TOO_LONG
        kind = 8 * kind + mode
    if rig.parts & HAS_BODY:
        mode = _body(plant, rig, gravity, source[0], y, z, h, y_new, z_new)
        stable = stable and mode != TOO_LONG
        kind = 64 * kind + mode
    return kind if stable else TOO_LONG


@merged
def squeeze(terrain, row, position):
    """Value of a terrain's row at a position; 0 in a clear pipe."""
    return 0.0 if terrain.shape[0] == 0 else _squeezed(terrain, row, position)


@merged
def _squeezed(terrain, row, position):
    last = terrain.shape[1] - 1
    place = (position - terrain[0, 0]) * terrain[0, 1]
    if place <= 0.0:
        return terrain[row, 0]
    if place >= last:
        return terrain[row, last]
    i = int(place)
    return terrain[row, i] + (place - i) * (terrain[row, i + 1] - terrain[row, i])


@merged
def wall_force(plant, x, v, narrower):
    """Force of the wall by eq. (8), clipped at 0: the wall cannot pull."""
    q = plant.q
    depth = x - (q[layout.WALL_OFFSET] - narrower)
    if depth <= 0.0:
        return 0.0
    return max(q[layout.WALL_STIFFNESS] * depth + q[layout.WALL_DAMPING] * v, 0.0)


@merged
def _small(plant, rig, actuator, source, y, z, h, y_new, z_new, narrower):
    q = plant.q
    at = X_SMALL_HEAD + 3 * (actuator - 1)
    x, v, pressure = y[at], y[at + 1], y[at + 2]
    p_new = pressure_after(plant, rig, layout.SMALL, actuator, z, z_new, x, pressure, source, h)
    force, growth = resistance(plant, plant.small_curve, layout.SMALL, actuator, z, x, v, h)
    inertia = q[layout.SMALL + layout.MASS] / h
    drive = inertia * v - force + area_at(plant, layout.SMALL, x) * p_new
    v_new = drive / (inertia + growth)
    touches = 0
    if rig.wall:
        offset = q[layout.WALL_OFFSET] - narrower
        if x + h * v_new > offset:
            stiff, damping = q[layout.WALL_STIFFNESS], q[layout.WALL_DAMPING]
            pressed = (drive - stiff * (x - offset)) / (inertia + growth + h * stiff + damping)
            if stiff * (x + h * pressed - offset) + damping * pressed > 0.0:
                v_new = pressed
                touches = 1
    x_new = x + h * v_new
    y_new[at], y_new[at + 1] = x_new, v_new
    y_new[at + 2] = pressure_moved(plant, layout.SMALL, x, x_new, p_new)
    remember(plant, actuator, z, z_new, y_new[at], h * v_new, h)
    slow = 2 if x > q[layout.SMALL + layout.THRESHOLD] else 0
    forward = 4 if v_new > 0.0 else 0
    kind = touches + slow + (forward if plant.active & chains.SPRING else 0)
    return kind if growth >= _LEAST_GROWTH * q[layout.SMALL + layout.DAMPING] else TOO_LONG


@merged
def grip(plant, rig, gravity, end, y):
    """Normal force of an end by eq. (7), from the wall's force on its small actuator."""
    q = plant.q
    mass = q[layout.HEAD_MASS] if end == 0 else q[layout.TAIL_MASS]
    if rig.free:  # a single head segment, without its half of the body
        mass = q[layout.SEGMENT_MASS]
    at = X_SMALL_HEAD + 3 * end
    narrower = squeeze(rig.terrain, 5 + end, y[X_HEAD if end == 0 else X_TAIL])
    return _WALL_COUNT * wall_force(plant, y[at], y[at + 1], narrower) + mass * gravity[1]


@merged
def coefficient(plant, direction, sliding):
    """Coefficient of friction in a direction; `sliding` is the speed, 0 for an end at rest."""
    q, active = plant.q, plant.active
    rest = max(q[layout.MU_S], q[layout.MU_K])
    base = rest if sliding == 0.0 else q[layout.MU_K]
    if active & learnt.IN_GRIP_SPEED:
        term = learnt.GRIP_FORWARD if direction > 0.0 else learnt.GRIP_BACKWARD
        base *= 1.0 + learnt_at(plant.learnt, term, sliding)[0]
    if not active & (chains.FRICTION | chains.GRIP):
        return base
    return chains.friction(active, q, base, rest, sliding) * chains.grip(active, q, direction)


@merged
def _limit(plant, rig, end, normal, direction, sliding, y):
    """Greatest friction force at an end against motion in a direction."""
    force = coefficient(plant, direction, sliding) * normal
    place = y[X_HEAD if end == 0 else X_TAIL]
    if plant.active & learnt.IN_GRIP_PLACE:
        force *= 1.0 + learnt_at(plant.learnt, learnt.GRIP_PLACE, place)[0]
    if plant.active & learnt.IN_FRICTION_SPEED:
        term = learnt.FORWARD if direction > 0.0 else learnt.BACKWARD
        force += learnt_at(plant.learnt, term, sliding)[0]
    if plant.active & learnt.IN_FRICTION_PLACE:
        force += learnt_at(plant.learnt, learnt.PLACE, place)[0]
    if end == 1:
        force += chains.drag(plant.active, plant.q, place)
    if rig.terrain.shape[0]:
        row = 1 + 2 * end + (0 if direction > 0.0 else 1)
        force += squeeze(rig.terrain, row, place)
    if plant.active & learnt.IN_FRICTION:
        force = max(force, 0.0)
    return force


@merged
def _body(plant, rig, gravity, source, y, z, h, y_new, z_new):
    q = plant.q
    x = y[X_HEAD] - y[X_TAIL]
    v_h, v_t = y[V_HEAD], y[V_TAIL]
    p_new = pressure_after(plant, rig, layout.BODY, 0, z, z_new, x, y[P_BODY], source, h)
    force, growth = resistance(plant, plant.body_curve, layout.BODY, 0, z, x, v_h - v_t, h)
    tension = force - area_at(plant, layout.BODY, x) * p_new
    if rig.free:
        inertia = q[layout.BODY + layout.MASS] / h
        w_h, w_t, moving = (inertia * v_h - tension) / (inertia + growth), 0.0, 0
    else:
        w_h, w_t, moving = _ends(plant, rig, gravity, tension, growth, y, y_new, h)
    y_new[X_HEAD], y_new[V_HEAD] = y[X_HEAD] + h * w_h, w_h
    y_new[X_TAIL], y_new[V_TAIL] = y[X_TAIL] + h * w_t, w_t
    x_new = y_new[X_HEAD] - y_new[X_TAIL]
    y_new[P_BODY] = pressure_moved(plant, layout.BODY, x, x_new, p_new)
    remember(plant, 0, z, z_new, x_new, h * (w_h - w_t), h)
    slow = 9 if x > q[layout.BODY + layout.THRESHOLD] else 0
    forward = 18 if w_h > w_t else 0
    kind = moving + slow + (forward if plant.active & chains.SPRING else 0)
    return kind if growth >= _LEAST_GROWTH * q[layout.BODY + layout.DAMPING] else TOO_LONG


@merged
def _ends(plant, rig, gravity, tension, growth, y, y_new, h):
    """Velocities of head and tail after a step with friction, and their directions s as 3 (s_h + 1) + s_t + 1."""
    q = plant.q
    uphill = gravity[0]
    m_h, m_t = q[layout.HEAD_MASS] / h, q[layout.TAIL_MASS] / h
    normal_h, normal_t = grip(plant, rig, gravity, 0, y_new), grip(plant, rig, gravity, 1, y_new)
    v_h, v_t = y[V_HEAD], y[V_TAIL]
    push_h = -tension - q[layout.HEAD_MASS] * uphill
    push_t = tension - q[layout.TAIL_MASS] * uphill
    s_h = _sign(v_h)
    s_t = _sign(v_t)
    may_h, may_t = s_h == 0.0, s_t == 0.0  # may start to slide in this step
    if may_h and may_t:
        s_h, s_t = _first_to_start(plant, rig, normal_h, normal_t, push_h, push_t, y)
        may_h, may_t = s_h == 0.0, s_t == 0.0
    w_h = w_t = 0.0
    for _ in range(6):
        drive_h = m_h * v_h + push_h
        drive_t = m_t * v_t + push_t
        if s_h != 0.0:
            drive_h -= s_h * _limit(plant, rig, 0, normal_h, s_h, max(abs(v_h), 1e-12), y)
        if s_t != 0.0:
            drive_t -= s_t * _limit(plant, rig, 1, normal_t, s_t, max(abs(v_t), 1e-12), y)
        w_h = w_t = 0.0
        if s_h != 0.0 and s_t != 0.0:
            a, d = m_h + growth, m_t + growth
            determinant = a * d - growth * growth
            w_h = (d * drive_h + growth * drive_t) / determinant
            w_t = (growth * drive_h + a * drive_t) / determinant
        elif s_h != 0.0:
            w_h = drive_h / (m_h + growth)
        elif s_t != 0.0:
            w_t = drive_t / (m_t + growth)
        if s_h != 0.0 and w_h * s_h <= 0.0:
            s_h, may_h = 0.0, False
            weaker, _ = _first_to_start(plant, rig, normal_h, normal_t, push_h, push_t, y)
            may_t = may_t and weaker == 0.0  # if the head's hold is the weaker one, it starts in the next step
            continue
        if s_t != 0.0 and w_t * s_t <= 0.0:
            s_t, may_t = 0.0, False
            _, weaker = _first_to_start(plant, rig, normal_h, normal_t, push_h, push_t, y)
            may_h = may_h and weaker == 0.0
            continue
        if s_h == 0.0 and may_h:
            s_h = _starts(plant, rig, 0, normal_h, push_h + growth * w_t, y)
            may_h = False
            if s_h != 0.0:
                continue
        if s_t == 0.0 and may_t:
            s_t = _starts(plant, rig, 1, normal_t, push_t + growth * w_h, y)
            may_t = False
            if s_t != 0.0:
                continue
        break
    if s_h == 0.0:
        w_h = 0.0
    if s_t == 0.0:
        w_t = 0.0
    return w_h, w_t, int(3.0 * (s_h + 1.0) + s_t + 1.0)


@merged
def _first_to_start(plant, rig, normal_h, normal_t, push_h, push_t, y):
    """Directions in which two resting ends start to slide if friction gives way at both in the same step. If one push
    exceeds its hold by more, that end starts alone, since the damper then unloads the other; if the excesses are equal
    (both ends free, equal halves), both start together."""
    side_h, side_t = _sign(push_h), _sign(push_t)
    hold_h = _limit(plant, rig, 0, normal_h, side_h, 0.0, y)
    hold_t = _limit(plant, rig, 1, normal_t, side_t, 0.0, y)
    excess_h, excess_t = abs(push_h) - hold_h, abs(push_t) - hold_t
    if excess_h <= 0.0 or excess_t <= 0.0:
        return 0.0, 0.0
    if abs(excess_h - excess_t) <= _ALIKE * (hold_h + hold_t):
        return side_h, side_t
    return (side_h, 0.0) if excess_h > excess_t else (0.0, side_t)


@merged
def _starts(plant, rig, end, normal, push, y):
    """Direction in which a resting end starts to slide under `push`; 0 if friction holds it."""
    if push > 0.0:
        return 1.0 if push > _limit(plant, rig, end, normal, 1.0, 0.0, y) else 0.0
    return -1.0 if -push > _limit(plant, rig, end, normal, -1.0, 0.0, y) else 0.0


@merged
def _sign(v):
    return 1.0 if v > 0.0 else (-1.0 if v < 0.0 else 0.0)
