"""Values that were not measured: a marker's position held or set to zero while it was lost, and codes for missing
values."""

import numpy as np

_CODES = (999.0, 9999.0, 99999.0, 999999.0)  # of either sign, as exporters write for missing values
_MIN_HELD_SAMPLES = 3  # equal samples in a row; two may be chance
# Largest share of equal neighbours elsewhere: a coarse instrument, or a marker at rest, repeats values.
_MAX_REPEAT_SHARE = 0.05
_JUMP_MM = 1.0  # smallest jump before or after a run of equal samples that shows the marker moved meanwhile
_CERTAIN_JUMP_MM = 5.0  # a jump this large at both ends of a run is not a motion


def codes(values: np.ndarray) -> np.ndarray:
    """Flag samples that are codes for missing values, shape (n,); none if all samples are, since a code occurs among
    other values."""
    found = np.isin(np.abs(values), _CODES)
    return found if not found.all() else np.zeros(len(values), bool)


def held(values_mm: np.ndarray) -> np.ndarray:
    """Flag samples of a tracked displacement that repeat the one before because the marker was lost, shape (n,): the
    displacement jumps before or after the run. A marker at rest may repeat a value without being lost."""
    found = np.zeros(len(values_mm), bool)
    same = np.diff(values_mm) == 0.0
    for first, last in runs(same):  # `same` is about steps: samples first to last, both included, are equal
        if last - first + 1 < _MIN_HELD_SAMPLES:
            continue
        entry = abs(values_mm[first] - values_mm[first - 1]) if first else 0.0
        leave = abs(values_mm[last + 1] - values_mm[last]) if last + 1 < len(values_mm) else 0.0
        elsewhere = same.sum() - (last - first) <= _MAX_REPEAT_SHARE * len(same)
        if min(entry, leave) > _CERTAIN_JUMP_MM:  # set to an unrelated number: not even the first sample was measured
            found[first : last + 1] = True
        elif elsewhere and max(entry, leave) > _JUMP_MM:
            found[first + 1 : last + 1] = True
    return found


def runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Return (first, last + 1) of each run of true values in `flags`, shape (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
