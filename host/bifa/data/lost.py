"""Numbers that nobody measured: a marker held, or set to zero, while it was out of sight; a code for a missing
value."""

import numpy as np

_CODES = (999.0, 9999.0, 99999.0, 999999.0)  # of either sign, as exporters write where they have no value
_HELD = 3  # equal samples in a row; two may be chance
_RARELY = 0.05  # of neighbouring samples that are equal elsewhere: a coarser instrument, or one that rests, repeats
_JUMP_MM = 1.0  # with which a held marker is found again, where it had been moving
_FAR_MM = 5.0  # no motion there and back again


def codes(values: np.ndarray) -> np.ndarray:
    """Which samples are codes for a missing value: one distinct number among other values, shape (n,)."""
    found = np.isin(np.abs(values), _CODES)
    return found if not found.all() else np.zeros(len(values), bool)


def held(values_mm: np.ndarray) -> np.ndarray:
    """Which samples of a tracked displacement repeat the one before because the marker was lost, shape (n,): it was
    elsewhere before the run, or after it. A marker at rest may repeat a value without being lost."""
    found = np.zeros(len(values_mm), bool)
    same = np.diff(values_mm) == 0.0
    for first, last in runs(same):  # samples: one more than there are steps between them
        if last - first + 1 < _HELD:
            continue
        entry = abs(values_mm[first] - values_mm[first - 1]) if first else 0.0
        leave = abs(values_mm[last + 1] - values_mm[last]) if last + 1 < len(values_mm) else 0.0
        elsewhere = same.sum() - (last - first) <= _RARELY * len(same)
        if min(entry, leave) > _FAR_MM:  # set to a number of its own: nothing of it was measured
            found[first : last + 1] = True
        elif elsewhere and max(entry, leave) > _JUMP_MM:
            found[first + 1 : last + 1] = True
    return found


def runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Of each run of true in `flags`, shape (n,), the first index and the one beyond the last."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
