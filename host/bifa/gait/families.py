"""Families of gaits: around these ended long robust searches, of the nominal robot and of models with each effect.

A family's basin is narrow, and climbs from elsewhere seldom come upon it; which is the fastest differs from robot to
robot. Robust searches climb from those that come near the best, each with the period that suits the robot, beside
basins of their own: robots that none of these suits are searched as if there were none.
"""

from bifa.robot.gait import Gait

# psi12 and psi13 tell by how much head and tail run ahead of the body.
FAMILIES = (
    Gait(2.68, 217.0, 340.0, 0.665, 0.465, 0.465),  # the paper's: tail 20 degrees behind, ends half the cycle at vacuum
    Gait(2.68, 168.0, 335.0, 0.666, 0.450, 0.450),  # the same with a later head: where sensors lag
    Gait(2.70, 198.0, 86.0, 0.668, 0.730, 0.730),  # tail 85 degrees ahead, ends three quarters of the cycle at vacuum
    Gait(2.75, 205.5, 82.5, 0.676, 0.717, 0.717),  # a second top of that one, from which it is separated by a cliff
    Gait(3.20, 240.0, 356.0, 0.612, 0.484, 0.484),  # both, where the body fills slowly: choked valves
    Gait(3.20, 215.0, 102.0, 0.614, 0.640, 0.640),
)
# In parts of a family's own: robots differ in speed by a third.
PERIODS = (0.0, 0.02, 0.04, 0.08, 0.12, 0.16, 0.2, 0.25, 0.3, 0.4)
