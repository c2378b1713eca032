"""Curves learnt from data, for discrepancies that no effect of the library explains, and where they enter the
integrator.

`Plant.learnt` has one row per term: (lower, 1 / interval, values at equal intervals). It is empty if nothing was
learnt. Outside its range a curve is constant. Each place in the integrator where a curve acts has a bit in
`Plant.active`, above the effects' bits.
"""

from bifa.simulate.compiled import merged

# Added to a chamber's pressure rate of eq. (2), in psi/s, over its pressure: while filling, and while emptying
FILLING, EMPTYING = 0, 1
# Added to an end's friction of eq. (5), in N, over its speed in m/s: forward, backward; over its place in the pipe, m
FORWARD, BACKWARD, PLACE = 2, 3, 4
# Added to the force of the body's damper, b v in eq. (1), in N, over velocity in m/s
DAMPING = 5
# Relative change of the friction coefficients of eq. (5), over an end's speed in m/s: forward, backward; over its place
GRIP_FORWARD, GRIP_BACKWARD, GRIP_PLACE = 6, 7, 8
# Relative change of the area a of eq. (2), over the share of the stroke
AREA = 9
TERMS = 10

# Above the bits of the effects (at most 48).
IN_FILLING, IN_FRICTION_SPEED, IN_FRICTION_PLACE, IN_DAMPING, IN_GRIP_SPEED, IN_GRIP_PLACE, IN_AREA = (
    1 << bit for bit in range(48, 55)
)
IN_FRICTION = IN_FRICTION_SPEED | IN_FRICTION_PLACE | IN_GRIP_SPEED | IN_GRIP_PLACE


@merged
def learnt_at(rows, term, at):
    """Value and slope of a term's curve."""
    last = rows.shape[1] - 3
    place = min(max((at - rows[term, 0]) * rows[term, 1], 0.0), float(last))
    i = min(int(place), last - 1)
    rise = rows[term, i + 3] - rows[term, i + 2]
    inside = 0.0 < place < last
    return rows[term, i + 2] + (place - i) * rise, rise * rows[term, 1] if inside else 0.0
