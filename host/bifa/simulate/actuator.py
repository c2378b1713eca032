"""One actuator over one step: eq. (1)-(3), linearly implicit in the velocity, exact in the pressure.

The pressure state is p = F / a, in psi, which keeps a varying area separate from the air.
`actuator` is 0 body, 1 head, 2 tail (the offset in the effects' states `z`); `block` is layout.BODY or SMALL.
"""

import math

from bifa.simulate import layout
from bifa.simulate.compiled import merged
from bifa.simulate.hooks import chains
from bifa.simulate.learnt import AREA, DAMPING, EMPTYING, FILLING, IN_AREA, IN_DAMPING, IN_FILLING, learnt_at


@merged
def reach(curve):
    """Lower and upper end of a stiffness table, and 1 / width of its intervals."""
    return curve[0, 0], curve[0, 1], curve[0, 2]


@merged
def cubic(curve, row):
    """The four coefficients in a row of a stiffness table."""
    return curve[row, 0], curve[row, 1], curve[row, 2], curve[row, 3]


@merged
def stiffness(curve, x):
    """K(x) and its slope, with linear extrapolation outside the table."""
    lower, upper, per_width = reach(curve)
    place = (min(max(x, lower), upper) - lower) * per_width
    i = min(int(place), curve.shape[0] - 2)
    s = place - i
    c0, c1, c2, c3 = cubic(curve, i + 1)
    slope = (c1 + s * (2.0 * c2 + 3.0 * s * c3)) * per_width
    force = c0 + s * (c1 + s * (c2 + s * c3))
    if x < lower:
        force += slope * (x - lower)
    elif x > upper:
        force += slope * (x - upper)
    return force, slope


@merged
def convergence(q, block, x, inlet):
    """The convergence factor alpha of eq. (3)."""
    return q[block + layout.ALPHA_S] if x > q[block + layout.THRESHOLD] and inlet < 0.0 else q[block + layout.ALPHA_N]


@merged
def pressure_after(plant, rig, block, actuator, z, z_new, x, pressure, source, h):
    """The pressure after a step by eq. (2), exact for a constant inlet pressure and convergence factor."""
    q, active = plant.q, plant.active
    inlet = chains.line(active, q, z, actuator, z_new, source, h)
    rate = chains.filling(active, q, convergence(q, block, x, inlet), pressure, inlet, rig.share[actuator])
    total = rate + chains.loss(active, q, pressure)
    settled = inlet * rate / total
    after = settled + (pressure - settled) * math.exp(-total * h)
    if active & IN_FILLING:
        after += h * learnt_at(plant.learnt, FILLING if inlet > pressure else EMPTYING, pressure)[0]
    return after


@merged
def area_at(plant, block, x):
    """The area a of eq. (2), in N/psi."""
    q = plant.q
    share = (x - q[block + layout.CONTRACTED]) / q[block + layout.STROKE]
    factor = chains.area(plant.active, q, share)
    if plant.active & IN_AREA:
        factor *= 1.0 + learnt_at(plant.learnt, AREA, share)[0]
    return q[block + layout.AREA] * factor


@merged
def pressure_moved(plant, block, before, after, pressure):
    """The pressure after the stroke has changed from `before` to `after`, if the area varies along it."""
    if not plant.active & chains.AIR:
        return pressure
    ratio = area_at(plant, block, before) / area_at(plant, block, after)
    return pressure * chains.air(plant.active, plant.q, ratio)


@merged
def resistance(plant, curve, block, actuator, z, x, v, h):
    """Linearise spring and damper over a step: `force + growth * velocity`, with the velocity at the step's end."""
    q, active = plant.q, plant.active
    if active & chains.PLAY:
        here = chains.play(active, q, z, actuator, x)
        force, slope = stiffness(curve, here)
        if v != 0.0:
            slope *= (chains.play(active, q, z, actuator, x + h * v) - here) / (h * v)
    else:
        force, slope = stiffness(curve, x)
    growth = q[block + layout.DAMPING] + h * slope
    if active & chains.SPRING:
        direction = 1.0 if v > 0.0 else (-1.0 if v < 0.0 else 0.0)
        more, steeper = chains.spring(active, q, z, actuator, block == layout.SMALL, direction, h)
        force += more
        growth += steeper
    if active & IN_DAMPING and block == layout.BODY:
        more, steeper = learnt_at(plant.learnt, DAMPING, v)
        force += more - steeper * v
        growth += steeper
    return force, growth


@merged
def remember(plant, actuator, z, z_new, x_new, travel, h):
    """Update the effects' states of the spring after a step."""
    q, active = plant.q, plant.active
    if active & chains.SPRING_STATE:
        chains.spring_state(active, q, z, actuator, z_new, travel, h)
    if active & chains.PLAY:
        chains.play_state(active, q, z, actuator, z_new, x_new)


@merged
def read_pressure(plant, block, pressure, x, v, source):
    """Pressure at the sensor. Inside the chamber it is p = (F - b v) / a (section III.A), with a at this stroke."""
    q, active = plant.q, plant.active
    inside = pressure - q[block + layout.DAMPING] * v / area_at(plant, block, x)
    return chains.sensed(active, q, inside, source)
