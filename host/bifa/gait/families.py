"""Families of gaits in which long robust searches ended, on the nominal robot and on models with each effect.

A family's basin is narrow and seldom found from elsewhere, and which family is fastest differs from robot to robot.
Robust searches climb from the families that come near the best, each with the period that suits the robot, and from
basins found by exploration; if no family suits a robot, its search is as if there were none.
"""

from bifa.robot.gait import Gait

# psi12 and psi13 are the phases by which head and tail lead the body.
FAMILIES = (
    Gait(2.68, 217.0, 340.0, 0.665, 0.465, 0.465),  # the paper's: tail 20 degrees behind, ends half the cycle at vacuum
    Gait(2.68, 168.0, 335.0, 0.666, 0.450, 0.450),  # the same with a later head, for lagging sensors
    Gait(2.70, 198.0, 86.0, 0.668, 0.730, 0.730),  # tail 85 degrees ahead, ends three quarters of the cycle at vacuum
    Gait(2.75, 205.5, 82.5, 0.676, 0.717, 0.717),  # a second optimum of that one, beyond a cliff
    Gait(2.557, 220.3, 338.0, 0.6545, 0.457, 0.457),  # with the next: the first and the third at the edge of a fit
    Gait(2.60, 199.0, 85.5, 0.655, 0.680, 0.680),
    Gait(3.20, 240.0, 356.0, 0.612, 0.484, 0.484),  # with the next: both, for choked valves (slow filling)
    Gait(3.20, 215.0, 102.0, 0.614, 0.640, 0.640),
)
# Relative changes of a family's period that are tried: robots differ in speed by a third.
PERIODS = (-0.05, -0.025, 0.0, 0.02, 0.04, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.4)
