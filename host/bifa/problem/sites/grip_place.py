"""The friction's coefficients, by the end's place in the pipe."""

from bifa.problem.inputs import WALK
from bifa.problem.sites.site import PLACE, Site

SITE = Site(
    "grip_place",
    "friction coefficient of an end, eq. (5), by its place in the pipe",
    PLACE,
    "",
    0.03,
    experiments=(WALK,),
    knots=129,
    equation=True,
)
