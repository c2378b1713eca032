"""Adaptive time stepping: steps as long as the error allows, ending exactly at switches and samples.

Each step h is taken once whole and once as two halves. Their difference estimates the error, and 2 (halves) - (whole)
is second-order accurate. If the three steps differ in kind (an end started to slide, touched the wall or passed x_th
in between), the result of the halves is kept unextrapolated, and a tighter tolerance keeps the step short.
"""

import math
from typing import NamedTuple

import numpy as np

from bifa.simulate import layout
from bifa.simulate.actuator import read_pressure
from bifa.simulate.compiled import anyone, inner, kernel, least, merged, worst
from bifa.simulate.hooks import chains
from bifa.simulate.stepper import (
    P_BODY,
    STATES,
    TOO_LONG,
    V_HEAD,
    V_SMALL_HEAD,
    V_TAIL,
    X_HEAD,
    X_SMALL_HEAD,
    X_TAIL,
    gravity_of,
    sources,
    step,
)

LONGEST_S = 0.1
SHORTEST_S = 1e-5
FIRST_S = 1e-3
ARRIVED_S = 1e-12
_HOPELESS_S = 1e-6  # if even shorter steps are needed, there is no solution: the run becomes NaN
# Limit on a run's steps so far, at a tolerance of 1 um: an initial allowance plus ten times what walking takes. A run
# that exceeds it becomes NaN.
_MOST_STEPS, _MOST_STEPS_PER_S = 40_000.0, 20_000.0
_ABRUPT = 0.1  # share of the tolerance for steps in which something changes: there the result is first-order only
_POSITION, _VELOCITY, _PRESSURE, _SMALL_POSITION, _SMALL_VELOCITY = 1.0, 300.0, 300.0, 2.0, 600.0
# Tolerance of a position over that of each state. A velocity error of 1e-3 m/s shows as 0.015 psi in a reading.
_SHARES = 1.0 / np.array(
    [_POSITION, _VELOCITY, _POSITION, _VELOCITY, _PRESSURE, *(2 * (_SMALL_POSITION, _SMALL_VELOCITY, _PRESSURE))]
)


class Run(NamedTuple):
    """Working state of an integration. `y`, `z`: the present state; `clock`: time, proposed step, steps tried; `slip`:
    accumulated travel while both ends slide (the smaller of the two); `command`: (3,), one per chamber; the rest is
    scratch."""

    y: np.ndarray
    z: np.ndarray
    clock: np.ndarray
    slip: np.ndarray
    command: np.ndarray
    gravity: np.ndarray
    source: np.ndarray
    whole: np.ndarray
    first: np.ndarray
    halves: np.ndarray
    z_whole: np.ndarray
    z_first: np.ndarray
    z_halves: np.ndarray
    read: np.ndarray


@kernel
def new_run(states_of_effects):
    """A run at time 0 with all states 0 and all valves off."""
    n = states_of_effects
    return Run(
        np.zeros(STATES),
        np.zeros(n),
        np.array([0.0, FIRST_S, 0.0]),
        np.zeros(1),
        np.full(3, 2),
        np.zeros(2),
        np.zeros(3),
        np.zeros(STATES),
        np.zeros(STATES),
        np.zeros(STATES),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(3),
    )


@merged
def start_effects(plant, rig, run):
    """Initialise the effects' states for the positions and pressures in `run`."""
    y = run.y
    gravity_of(plant, rig, run.gravity)
    if plant.active & chains.INITIAL:
        for i in range(3):
            x = y[X_HEAD] - y[X_TAIL] if i == 0 else y[X_HEAD + 2 + 3 * i]
            chains.initial(plant.active, plant.q, run.z, i, x, y[P_BODY + 3 * i])
    sources(plant, rig, run.command, y, run.clock[0], run.source)
    pressures(plant, run)


@merged
def pressures(plant, run):
    """Write the pressures at the sensors into `run.read`."""
    y, read, source = run.y, run.read, run.source
    stroke, opening = y[X_HEAD] - y[X_TAIL], y[V_HEAD] - y[V_TAIL]
    read[0] = read_pressure(plant, layout.BODY, y[P_BODY], stroke, opening, source[0])
    for i in (1, 2):
        x, v = y[X_HEAD + 2 + 3 * i], y[V_SMALL_HEAD + 3 * (i - 1)]
        read[i] = read_pressure(plant, layout.SMALL, y[P_BODY + 3 * i], x, v, source[i])


@merged
def shown(plant, run, actuator):
    """Reading of an actuator's pressure sensor."""
    value = run.read[actuator]
    if plant.active & chains.SENSOR:
        value = chains.sensor(plant.active, plant.q, run.z, actuator, value, value, 1e-9)
    return chains.reading(plant.active, plant.q, value)


@inner
def march(plant, rig, run, until, tolerance):
    """Advance `run` to `until`. `tolerance` bounds the estimated error of a position in one step, in m."""
    while until - run.clock[0] > ARRIVED_S and math.isfinite(run.y[0]):
        attempt(plant, rig, run, until, tolerance)
    run.clock[0] = until
    arrive(plant, run)


@kernel
def march_through(plant, rig, run, until, tolerance, late, order, chamber, command, i):
    """March to `until`, switching valves on the way. Returns the index of the next switch."""
    while i < order.size and late[order[i]] <= until:
        k = order[i]
        march(plant, rig, run, late[k], tolerance)
        run.command[chamber[k]] = command[k]
        i += 1
    march(plant, rig, run, until, tolerance)
    return i


@merged
def arrive(plant, run):
    """Update the pressure readings at the end of a march."""
    if not plant.active & chains.SENSOR and math.isfinite(run.y[0]):
        pressures(plant, run)


@merged
def attempt(plant, rig, run, until, tolerance):
    """Try one step towards `until`. A run without a solution becomes NaN."""
    clock = run.clock
    y, z = run.y, run.z
    whole, first, halves = run.whole, run.first, run.halves
    left = until - clock[0]
    h = min(clock[1], LONGEST_S)
    if h > 0.5 * left:
        h = left if h >= left else 0.5 * left
    h = least(run, h)
    sources(plant, rig, run.command, y, clock[0] + h, run.source)
    kind = step(plant, rig, run.gravity, run.source, y, z, h, whole, run.z_whole)
    sources(plant, rig, run.command, y, clock[0] + 0.5 * h, run.source)
    kind_first = step(plant, rig, run.gravity, run.source, y, z, 0.5 * h, first, run.z_first)
    sources(plant, rig, run.command, first, clock[0] + h, run.source)
    kind_second = step(plant, rig, run.gravity, run.source, first, run.z_first, 0.5 * h, halves, run.z_halves)
    too_long = kind == TOO_LONG or kind_first == TOO_LONG or kind_second == TOO_LONG
    clock[2] += 1.0
    patience = max(1.0, math.sqrt(1e-6 / tolerance))
    tired = clock[2] > patience * (_MOST_STEPS + _MOST_STEPS_PER_S * max(clock[0], 0.0))
    if tired or (too_long and h < _HOPELESS_S):
        y[:] = np.nan
        return
    if anyone(run, too_long):
        clock[1] = 0.3 * h
        return
    error = 0.0
    for i in range(STATES):
        error = max(error, abs(halves[i] - whole[i]) * (_SHARES[i] if i < X_SMALL_HEAD else _SHARES[i] / rig.looser))
    error = max(error, _cut_short(y, first, h))
    smooth = kind == kind_first and kind == kind_second
    error = worst(run, error / (tolerance if smooth else _ABRUPT * tolerance))
    if error > 1.0 and h > SHORTEST_S:
        clock[1] = h * max(0.2, 0.9 / math.sqrt(error))
        return
    run.slip[0] += _both_slide(y, first) + _both_slide(first, halves)
    _accept(plant, run, smooth)
    clock[0] += h
    if plant.active & chains.SENSOR:
        _sense(plant, run, h)
    grown = min(3.0, 0.9 / math.sqrt(max(error, 1e-6)))
    clock[1] = max(clock[1], h * grown) if h < 0.5 * clock[1] else h * grown


@merged
def _accept(plant, run, smooth):
    y, z = run.y, run.z
    for i in range(STATES):
        y[i] = 2.0 * run.halves[i] - run.whole[i] if smooth else run.halves[i]
    if run.halves[V_HEAD] == 0.0:
        y[V_HEAD] = 0.0
    if run.halves[V_TAIL] == 0.0:
        y[V_TAIL] = 0.0
    if plant.active:
        for i in range(z.size):
            z[i] = 2.0 * run.z_halves[i] - run.z_whole[i] if smooth else run.z_halves[i]


@merged
def _cut_short(before, first, h):
    """Travel that is lost if an end comes to rest within the first half: whole and halves then agree, but are wrong."""
    lost = 0.0
    if first[V_HEAD] == 0.0:
        lost = abs(before[V_HEAD])
    if first[V_TAIL] == 0.0:
        lost = max(lost, abs(before[V_TAIL]))
    return 0.25 * h * lost


@merged
def _both_slide(before, after):
    if after[V_HEAD] == 0.0 or after[V_TAIL] == 0.0:
        return 0.0
    return min(abs(after[X_HEAD] - before[X_HEAD]), abs(after[X_TAIL] - before[X_TAIL]))


@merged
def _sense(plant, run, h):
    b0, b1, b2 = run.read[0], run.read[1], run.read[2]
    pressures(plant, run)
    chains.sensor(plant.active, plant.q, run.z, 0, b0, run.read[0], h)
    chains.sensor(plant.active, plant.q, run.z, 1, b1, run.read[1], h)
    chains.sensor(plant.active, plant.q, run.z, 2, b2, run.read[2], h)
