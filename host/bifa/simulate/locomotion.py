"""Simulation of walks, driven by a timeline of switches."""

import numpy as np

from bifa.simulate import layout
from bifa.simulate.compiled import kernel, merged
from bifa.simulate.march import march_through, new_run, shown, start_effects
from bifa.simulate.stepper import STATES, V_HEAD, V_TAIL, X_HEAD, X_SMALL_HEAD, X_SMALL_TAIL, X_TAIL, grip
from bifa.simulate.timeline import delayed

# Columns of a record: the state y, the sensor readings, the normal forces (7), and the travel while both ends slid.
READ_BODY = STATES
NORMAL_HEAD = STATES + 3
SLIP = STATES + 5
COLUMNS = STATES + 6


@merged
def contracted(plant, rig, run):
    """Initialise a run at the start of a walk: at rest, vented and contracted, with the tail's end at 0."""
    run.y[X_HEAD] = plant.q[layout.BODY + layout.CONTRACTED]
    run.y[X_SMALL_HEAD] = run.y[X_SMALL_TAIL] = plant.q[layout.SMALL + layout.CONTRACTED]
    start_effects(plant, rig, run)


@merged
def walk_row(plant, rig, run, row):
    """Write the present row of a walk's record into `row` (COLUMNS,)."""
    for i in range(STATES):
        row[i] = run.y[i]
    for actuator in range(3):
        row[READ_BODY + actuator] = shown(plant, run, actuator)
    row[NORMAL_HEAD] = grip(plant, rig, run.gravity, 0, run.y)
    row[NORMAL_HEAD + 1] = grip(plant, rig, run.gravity, 1, run.y)
    row[SLIP] = run.slip[0]


@merged
def seen_row(plant, rig, run, row):
    """Write what instruments measure in a walk into `row` (7,): position in m and velocity in m/s of the head, the same
    of the tail, and the three pressure readings in psi."""
    row[0], row[1], row[2], row[3] = run.y[X_HEAD], run.y[V_HEAD], run.y[X_TAIL], run.y[V_TAIL]
    for actuator in range(3):
        row[4 + actuator] = shown(plant, run, actuator)


@merged
def progress_row(plant, rig, run, row):
    """Write a walk's progress into `row` (2,): position of the head and travel while both ends slid, in m."""
    row[0], row[1] = run.y[X_HEAD], run.slip[0]


@kernel
def walk_record(plant, rig, states_of_effects, times, chamber, command, sample_times, tolerance, settled):
    """Simulate a walk from rest at time 0. Returns (n, COLUMNS) at `sample_times` (nondecreasing, none negative). If
    `settled` is not 0, all rows after three in which the head advances alike, within that share, are extrapolated."""
    run = new_run(states_of_effects)
    contracted(plant, rig, run)
    late, order = delayed(plant, times, chamber, command)
    out = np.empty((sample_times.size, COLUMNS))
    i = 0
    for k in range(sample_times.size):
        i = march_through(plant, rig, run, sample_times[k], tolerance, late, order, chamber, command, i)
        walk_row(plant, rig, run, out[k])
        if settled > 0.0 and k > 2:
            advance = out[k - 2 : k + 1, X_HEAD] - out[k - 3 : k, X_HEAD]
            if np.max(np.abs(advance - advance[2])) <= settled * abs(advance[2]):
                for later in range(k + 1, sample_times.size):
                    out[later] = 2.0 * out[later - 1] - out[later - 2]
                break
    return out
