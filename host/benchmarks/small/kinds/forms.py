"""Formulas that several truths share; none of them occurs in a model."""

import numpy as np
from numba import njit


@njit(nogil=True, cache=True)
def rounded_limit(value, limit):
    """Saturation with a corner rounded by a power of twenty."""
    return value if np.isinf(limit) else value / (1.0 + (value / limit) ** 20) ** (1.0 / 20.0)


@njit(nogil=True, cache=True)
def rounded_dead_zone(value, width, corner):
    """A dead zone of a positive quantity with a rounded corner; none for a width of 0."""
    if width <= 0.0:
        return value
    at = (value - width) / corner
    return corner * (at if at > 30.0 else np.log1p(np.exp(at)))


@njit(nogil=True, cache=True)
def dahl(speed, deflection_force, force, travel):
    """Rate of a bristle's force by Dahl's model, which approaches `force` within about `travel`."""
    return force / travel * (speed - np.abs(speed) * deflection_force / force) if force > 0.0 else 0.0
