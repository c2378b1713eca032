"""Single actuators on their stands: step response, static loading, anchor pull (paper, section IV)."""

import math

import numpy as np

from bifa.simulate import layout
from bifa.simulate.actuator import area_at, pressure_after, pressure_moved, remember, resistance
from bifa.simulate.compiled import anywhere, kernel, merged
from bifa.simulate.hooks import chains
from bifa.simulate.march import march, march_through, new_run, pressures, shown, start_effects
from bifa.simulate.stepper import (
    HAS_BODY,
    P_BODY,
    POSITIVE,
    VACUUM,
    X_HEAD,
    X_SMALL_HEAD,
    Mounting,
    coefficient,
    grip,
    sources,
)
from bifa.simulate.timeline import delayed

SETTLE_S = 30.0  # under vacuum before a step response: many times every time constant
HOLD_S = 20.0  # at the test pressure before a static loading or a pull; before a pull, as long again to extend the head
_SUBSTEP_S = 0.005


@merged
def _places(rig):
    """Actuator, block, and indices of position and pressure in y, for the only actuator of a stand."""
    if rig.parts & HAS_BODY:
        return 0, layout.BODY, X_HEAD, P_BODY
    return 1, layout.SMALL, X_SMALL_HEAD, P_BODY + 3


@merged
def held(plant, rig, run, start, command, seconds):
    """Initialise a run at position `start`, at rest and vented, with `command` applied `seconds` before time 0."""
    actuator, _, x, _ = _places(rig)
    run.y[x] = start
    run.clock[0] = -seconds
    run.command[actuator] = command
    start_effects(plant, rig, run)


@merged
def under_vacuum(plant, rig, run):
    """Initialise a run at the start of a step response."""
    _, block, _, _ = _places(rig)
    held(plant, rig, run, plant.q[block + layout.CONTRACTED], VACUUM, SETTLE_S)


@kernel
def _supplied(rig, positive_psi):
    return Mounting(
        rig.parts,
        rig.free,
        rig.wall,
        rig.looser,
        rig.incline_rad,
        positive_psi,
        rig.negative_psi,
        rig.share,
        rig.terrain,
    )


@merged
def anchored(plant, rig, run):
    """Initialise a run at the start of an anchor pull, where the head is extended."""
    held(plant, rig, run, plant.q[layout.WALL_OFFSET], POSITIVE, 2.0 * HOLD_S)


@merged
def step_row(plant, rig, run, row):
    """Write displacement from contracted in m, velocity in m/s and pressure reading in psi into `row` (3,)."""
    actuator, block, x, _ = _places(rig)
    row[0] = run.y[x] - plant.q[block + layout.CONTRACTED]
    row[1] = run.y[x + 1]
    row[2] = shown(plant, run, actuator)


@kernel
def step_record(plant, rig, states_of_effects, times, command, sample_times, tolerance):
    """Simulate a step response, at rest under vacuum at time 0. Returns rows of `step_row`, (n, 3)."""
    actuator, _, _, _ = _places(rig)
    run = new_run(states_of_effects)
    under_vacuum(plant, rig, run)
    march(plant, rig, run, 0.0, tolerance)
    chamber = np.full_like(command, actuator)
    late, order = delayed(plant, times, chamber, command)
    out = np.empty((sample_times.size, 3))
    i = 0
    for k in range(sample_times.size):
        i = march_through(plant, rig, run, sample_times[k], tolerance, late, order, chamber, command, i)
        step_row(plant, rig, run, out[k])
    return out


@kernel
def static_record(plant, rig, states_of_effects, displacement, sample_times):
    """Simulate a static loading along `displacement` (n,). Returns (n, 2): the testing machine's force in N and the
    pressure reading in psi.

    Quasi-static: K(x) - a p without the damper, while the air and the states of the effects evolve in time. The
    pressure is held for `HOLD_S` before the record begins.
    """
    out = np.empty((sample_times.size, 2))
    run = new_run(states_of_effects)
    static_rows(plant, rig, run, displacement, sample_times, out)
    return out


@merged
def static_rows(plant, rig, run, displacement, sample_times, out):
    """Compute `static_record` with a new run, into `out`."""
    actuator, block, x, p = _places(rig)
    contracted = plant.q[block + layout.CONTRACTED]
    y, z = run.y, run.z
    y[x] = contracted + displacement[0]
    run.command[actuator] = POSITIVE
    start_effects(plant, rig, run)
    wavering = anywhere(plant.active & chains.SUPPLY)  # otherwise the supply pressure is constant
    now = sample_times[0] - HOLD_S
    before = y[x]
    for k in range(sample_times.size):
        span = sample_times[k] - now
        target = contracted + displacement[k]
        steps = max(1, math.ceil(span / _SUBSTEP_S - 1e-9)) if wavering or k == 0 else 1
        if span > 0.0:
            h = span / steps
            for s in range(steps):
                reached = before + (target - before) * (s + 1) / steps
                sources(plant, rig, run.command, y, now + (s + 1) * h, run.source)
                pressure = pressure_after(plant, rig, block, actuator, z, z, y[x], y[p], run.source[actuator], h)
                y[p] = pressure_moved(plant, block, y[x], reached, pressure)
                remember(plant, actuator, z, z, reached, reached - y[x], h)
                y[x] = reached
                if plant.active & chains.SENSOR:
                    old = run.read[actuator]
                    pressures(plant, run)
                    chains.sensor(plant.active, plant.q, z, actuator, old, run.read[actuator], h)
        now, before = sample_times[k], target
        pressures(plant, run)
        spring = 0.0
        if actuator == 0:
            spring, _ = resistance(plant, plant.body_curve, block, actuator, z, y[x], 0.0, 0.0)
        else:
            spring, _ = resistance(plant, plant.small_curve, block, actuator, z, y[x], 0.0, 0.0)
        out[k, 0] = spring - area_at(plant, block, y[x]) * y[p]
        out[k, 1] = shown(plant, run, actuator)


@kernel
def anchor_record(plant, rig, states_of_effects, extended_psi, rate, load_cell, sample_times, tolerance):
    """Simulate pulling a head at `rate` m/s (the sign is the direction). Returns (n, 5): resistance in N, pressure
    reading in psi, the load cell's pull if the head did not slip, the greatest static friction, and the kinetic
    friction, in N.

    The head is first extended at `extended_psi` or `rig.positive_psi`, whichever is greater, then held at the latter.
    Quasi-static: force builds up in the load cell's spring until static friction gives way; then kinetic friction at
    the pulling speed remains.
    """
    run = new_run(states_of_effects)
    anchored(plant, rig, run)
    march(plant, _supplied(rig, max(rig.positive_psi, extended_psi)), run, -HOLD_S, tolerance)
    march(plant, rig, run, 0.0, tolerance)
    out = np.empty((sample_times.size, 5))
    for k in range(sample_times.size):
        if sample_times[k] > run.clock[0]:
            march(plant, rig, run, sample_times[k], tolerance)
        anchor_row(plant, rig, run, rate, load_cell, out[k])
    return out


@merged
def anchor_row(plant, rig, run, rate, load_cell, row):
    """Write the present row of `anchor_record`; `run.slip` is 1 once the head slides."""
    direction = 1.0 if rate > 0.0 else -1.0
    slack = chains.slack(plant.active, plant.q)
    normal = grip(plant, rig, run.gravity, 0, run.y)
    pull = load_cell * max(abs(rate) * run.clock[0] - slack, 0.0)
    holding = coefficient(plant, direction, 0.0) * normal
    kinetic = coefficient(plant, direction, abs(rate)) * normal
    if pull >= holding:
        run.slip[0] = 1.0
    row[0] = kinetic if run.slip[0] > 0.0 else pull
    row[1] = shown(plant, run, 1)
    row[2], row[3], row[4] = pull, holding, kinetic
