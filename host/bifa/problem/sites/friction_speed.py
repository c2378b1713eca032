"""The friction of an end, by its speed."""

from bifa.problem.inputs import WALK
from bifa.problem.sites.site import SPEED, Site

SITE = Site(
    "friction_speed",
    "friction of an end by its speed, eq. (5)",
    SPEED,
    "N",
    1.0,
    rows=("forward", "backward"),
    experiments=(WALK,),
    equation=True,
)
