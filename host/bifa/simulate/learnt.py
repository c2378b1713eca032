"""Curves learnt from data, where they act in the integrator: what no effect of the library explains.

`Plant.learnt` has a row a term, (lower, 1 / interval, values at equal intervals); no rows: nothing was learnt. Outside
its range a curve goes on level. A place in the integrator that has one is a bit of `Plant.active`, above the effects'.
"""

from __future__ import annotations

from bifa.simulate.compiled import merged

# psi/s that a chamber's pressure changes by beyond eq. (2), by that pressure: while it fills, and while it empties
FILLING, EMPTYING = 0, 1
# N of friction at an end beyond eq. (5), by its speed in m/s: forward, backward; and by its place in the pipe, in m
FORWARD, BACKWARD, PLACE = 2, 3, 4
# N of the body's damper beyond b v of eq. (1), by velocity in m/s
DAMPING = 5
# Share of the friction's coefficients beyond eq. (5), by an end's speed in m/s: forward, backward; and by its place
GRIP_FORWARD, GRIP_BACKWARD, GRIP_PLACE = 6, 7, 8
# Share of the area a beyond eq. (2), by the share of the stroke
AREA = 9
TERMS = 10

# Above the bits of effects, of which there may be 48.
IN_FILLING, IN_FRICTION_SPEED, IN_FRICTION_PLACE, IN_DAMPING, IN_GRIP_SPEED, IN_GRIP_PLACE, IN_AREA = (
    1 << bit for bit in range(48, 55)
)
IN_FRICTION = IN_FRICTION_SPEED | IN_FRICTION_PLACE | IN_GRIP_SPEED | IN_GRIP_PLACE


@merged
def learnt_at(rows, term, at):
    """Value of a term's curve, and its slope."""
    last = rows.shape[1] - 3
    place = min(max((at - rows[term, 0]) * rows[term, 1], 0.0), float(last))
    i = min(int(place), last - 1)
    rise = rows[term, i + 3] - rows[term, i + 2]
    inside = 0.0 < place < last
    return rows[term, i + 2] + (place - i) * rise, rise * rows[term, 1] if inside else 0.0
