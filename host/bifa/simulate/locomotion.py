"""Walks: marching through a timeline of switches, sampled or a cycle at a time."""

from __future__ import annotations

import numpy as np

from bifa.simulate import layout
from bifa.simulate.compiled import kernel
from bifa.simulate.march import march, new_run, shown, start_effects
from bifa.simulate.stepper import (
    STATES,
    X_HEAD,
    X_SMALL_HEAD,
    X_SMALL_TAIL,
    grip,
)
from bifa.simulate.timeline import delayed, gait_switches

# Columns of a record: the state y, then what the sensors say, then the normal forces (7).
READ_BODY = STATES
NORMAL_HEAD = STATES + 3
COLUMNS = STATES + 5


@kernel
def rest(plant, rig, states_of_effects):
    """A robot at rest, vented and contracted, its tail's end at 0."""
    run = new_run(states_of_effects)
    run.y[X_HEAD] = plant.q[layout.BODY + layout.CONTRACTED]
    run.y[X_SMALL_HEAD] = run.y[X_SMALL_TAIL] = plant.q[layout.SMALL + layout.CONTRACTED]
    start_effects(plant, rig, run)
    return run


@kernel
def _through(plant, rig, run, until, tolerance, late, order, chamber, command, i):
    """March to `until`, switching valves on the way; returns the next switch."""
    while i < order.size and late[order[i]] <= until:
        k = order[i]
        march(plant, rig, run, late[k], tolerance)
        run.command[chamber[k]] = command[k]
        i += 1
    march(plant, rig, run, until, tolerance)
    return i


@kernel
def walk_record(plant, rig, states_of_effects, times, chamber, command, sample_times, tolerance):
    """(n, COLUMNS) at `sample_times` (rising, from 0), of a walk that starts at rest at time 0."""
    run = rest(plant, rig, states_of_effects)
    late, order = delayed(plant, times, command)
    out = np.empty((sample_times.size, COLUMNS))
    i = 0
    for k in range(sample_times.size):
        i = _through(plant, rig, run, sample_times[k], tolerance, late, order, chamber, command, i)
        out[k, :STATES] = run.y
        for actuator in range(3):
            out[k, READ_BODY + actuator] = shown(plant, run, actuator)
        out[k, NORMAL_HEAD] = grip(plant, rig, run.gravity, 0, run.y)
        out[k, NORMAL_HEAD + 1] = grip(plant, rig, run.gravity, 1, run.y)
    return out


@kernel
def cycles_of_gait(plant, rig, states_of_effects, gait, cycles, tolerance, advance, slip):
    """Head's advance in m and slip in m of each cycle of a settled gait, from rest, into (cycles,) arrays."""
    run = rest(plant, rig, states_of_effects)
    times, chamber, command = gait_switches(gait, cycles * gait[0], 0.0)
    late, order = delayed(plant, times, command)
    i = 0
    for cycle in range(cycles):
        before, slid = run.y[X_HEAD], run.slip[0]
        i = _through(plant, rig, run, (cycle + 1) * gait[0], tolerance, late, order, chamber, command, i)
        advance[cycle] = run.y[X_HEAD] - before
        slip[cycle] = run.slip[0] - slid


@kernel
def gait_batch(plant, rig, states_of_effects, gaits, cycles, tolerance, advance, slip):
    """`cycles_of_gait` for rows of `gaits`."""
    for k in range(gaits.shape[0]):
        cycles_of_gait(plant, rig, states_of_effects, gaits[k], cycles, tolerance, advance[k], slip[k])
