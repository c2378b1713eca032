"""A testing machine's record around the motion of its cross-head, with the pressure that the Uno measured meanwhile."""

from collections.abc import Mapping

import numpy as np

from bifa.errors import BifaError

_MOVED_MM = 0.1  # displacement that counts as motion of the cross-head: well above its noise
_STILL_S = 1.0  # kept before and after the motion


def around_motion(
    time_s: np.ndarray,
    record: Mapping[str, np.ndarray],
    sampled_s: np.ndarray,
    pressure_psi: np.ndarray,
    lead_s: tuple[float, float] = (0.0, 0.0),
) -> dict[str, np.ndarray]:
    """Return a trial's columns from a machine's `record` with times `time_s` (n,), and the Uno's pressures with times
    `sampled_s`, both (m,): the motion with up to a second before and after it, at the machine's own times. All times
    are on the Uno's clock. lead_s: left out at the beginning and the end of the record, in which nothing moves. Raises
    BifaError if the two do not overlap, or nothing moves while both record."""
    place_mm = record["displacement_mm"]
    begin_s, end_s = max(time_s[0] + lead_s[0], sampled_s[0]), min(time_s[-1] - lead_s[1], sampled_s[-1])
    inside = (time_s >= begin_s) & (time_s <= end_s)
    if not inside.any():
        raise BifaError("the instrument's record and the Uno's do not overlap in time")
    moved = time_s[inside & (np.abs(place_mm - place_mm[inside][0]) > _MOVED_MM)]
    if not len(moved):
        raise BifaError("the cross-head did not move while the Uno recorded")
    inside &= (time_s >= moved[0] - _STILL_S) & (time_s <= moved[-1] + _STILL_S)
    kept_s = time_s[inside]
    nearest = np.clip(np.searchsorted(sampled_s, kept_s), 1, len(sampled_s) - 1)
    nearest -= kept_s - sampled_s[nearest - 1] < sampled_s[nearest] - kept_s
    return {
        "time_s": kept_s,
        "displacement_mm": place_mm[inside],
        "force_N": record["force_N"][inside],
        "pressure_psi": pressure_psi[nearest],
    }
