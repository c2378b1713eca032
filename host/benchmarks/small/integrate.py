"""Two independent integrators: one for the models that owners write, and a much finer one for the truth.

The input is held between samples in both. Rates and readings are compiled functions of time, state, input and the
values `p`; a rate writes into its last argument.
"""

import numpy as np
from numba import float64, njit, types, void

_ROW = types.Array(float64, 1, "C")
RATE, READ = void(float64, _ROW, float64, _ROW, _ROW), float64(float64, _ROW, float64, _ROW)
_RATE_TYPE, _READ_TYPE = types.FunctionType(RATE), types.FunctionType(READ)
_RUN = _ROW(_RATE_TYPE, _READ_TYPE, _ROW, _ROW, _ROW, _ROW, float64, float64)
FINER = 6  # steps of the truth per step of a model

rate = njit(RATE, nogil=True, cache=True)
read = njit(READ, nogil=True, cache=True)


@njit(nogil=True, cache=True)
def _supplied(time_s, held, supplied, at_s):
    """The integral of the held input from the first sample until `at_s`; nothing was supplied before."""
    if at_s <= time_s[0]:
        return 0.0
    place = min(np.searchsorted(time_s, at_s, side="right") - 1, len(time_s) - 1)
    return supplied[place] + held[place] * (at_s - time_s[place])


@njit(_RUN, nogil=True, cache=True)
def modeled(rates, reading, time_s, held, start, p, delay_s, step_s):
    """Classical Runge-Kutta; a delayed input is averaged over each step, so that the delay has a derivative."""
    n, states = len(time_s), len(start)
    found, x, supplied = np.empty(n), start.copy(), np.zeros(n)
    k1, k2, k3, k4 = np.zeros(states), np.zeros(states), np.zeros(states), np.zeros(states)
    for i in range(n - 1):
        supplied[i + 1] = supplied[i] + held[i] * (time_s[i + 1] - time_s[i])
    for i in range(n):
        found[i] = reading(time_s[i], x, held[i], p)
        if i == n - 1:
            break
        steps = max(1, int(np.ceil((time_s[i + 1] - time_s[i]) / step_s - 1e-9)))
        h = (time_s[i + 1] - time_s[i]) / steps
        for s in range(steps):
            t, u = time_s[i] + s * h, held[i]
            if delay_s > 0.0:
                late = t - delay_s
                u = (_supplied(time_s, held, supplied, late + h) - _supplied(time_s, held, supplied, late)) / h
            rates(t, x, u, p, k1)
            rates(t + 0.5 * h, x + 0.5 * h * k1, u, p, k2)
            rates(t + 0.5 * h, x + 0.5 * h * k2, u, p, k3)
            rates(t + h, x + h * k3, u, p, k4)
            x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return found


@njit(_RUN, nogil=True, cache=True)
def true(rates, reading, time_s, held, start, p, delay_s, step_s):
    """Ralston's third-order method; delays of a truth come from its states, not from `delay_s`."""
    found, x = np.empty(len(time_s)), start.copy()
    k1, k2, k3 = np.zeros(len(start)), np.zeros(len(start)), np.zeros(len(start))
    for i in range(len(time_s)):
        found[i] = reading(time_s[i], x, held[i], p)
        if i == len(time_s) - 1:
            break
        steps = FINER * max(1, int(np.ceil((time_s[i + 1] - time_s[i]) / step_s - 1e-9)))
        h = (time_s[i + 1] - time_s[i]) / steps
        for s in range(steps):
            t = time_s[i] + s * h
            rates(t, x, held[i], p, k1)
            rates(t + h / 2, x + h / 2 * k1, held[i], p, k2)
            rates(t + 3 * h / 4, x + 3 * h / 4 * k2, held[i], p, k3)
            x += h / 9 * (2 * k1 + 3 * k2 + 4 * k3)
    return found
