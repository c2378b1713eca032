"""The friction of an end, by its place in the pipe: joints, a damp stretch."""

from bifa.problem.inputs import WALK
from bifa.problem.sites.site import PLACE, Site

SITE = Site(
    "friction_place",
    "friction of an end by its place in the pipe, eq. (5)",
    PLACE,
    "N",
    1.0,
    experiments=(WALK,),
    knots=129,
    equation=True,
)
