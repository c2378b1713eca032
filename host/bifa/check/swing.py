"""How far a quantity follows a valve's command: reveals reversed signs, mirrored axes and swapped channels without a
model of the robot.

A chamber fills while its command is 1 and empties while it is 0, so its pressure goes all the way up and down over the
spans of its own command, less far over those of another chamber, and the opposite way if its sign is reversed.
"""

import numpy as np


def swing(command: np.ndarray, values: np.ndarray, time_s: np.ndarray) -> float | None:
    """Return by how much `values` rise while the command is 1 and fall while it is 0: the mean over spans between
    switches.

    All arguments have shape (samples,). Only whole cycles count (if there is one), and steady drift over them is
    removed (a robot that slides down a slope). None if the command never switches.
    """
    at = np.flatnonzero(np.diff(command))
    if not at.size:
        return None
    if at.size == 1:
        at = np.append(at, len(command) - 1)
    whole = (at.size - 1) // 2 * 2
    drift = 0.0
    if whole:
        at = at[: whole + 1]
        drift = (values[at[-1]] - values[at[0]]) / (time_s[at[-1]] - time_s[at[0]])
    change = np.diff(values[at]) - drift * np.diff(time_s[at])
    return float(np.mean(np.where(command[at[:-1] + 1] > 0.5, change, -change)))


def follow(command: np.ndarray, values: np.ndarray, time_s: np.ndarray) -> float | None:
    """Return `swing` as a share of the values' range, -1 to 1; None if the command or the values never change."""
    span, travel = float(np.ptp(values)), swing(command, values, time_s)
    return None if travel is None or span == 0.0 else travel / span
