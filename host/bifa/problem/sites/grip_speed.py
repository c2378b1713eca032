"""The friction's coefficients, by the speed of the end."""

from bifa.problem.inputs import ANCHOR, WALK
from bifa.problem.sites.site import SPEED, Site

SITE = Site(
    "grip_speed",
    "friction coefficient of an end, eq. (5), by its speed",
    SPEED,
    "",
    0.03,
    rows=("forward", "backward"),
    experiments=(ANCHOR, WALK),
    equation=True,
)
