"""The force of the small actuator's spring, over its stroke."""

from bifa.problem.inputs import ANCHOR, STATIC, STEP, WALK
from bifa.problem.sites.site import Site

SITE = Site(
    "small_spring",
    "force of the small actuator's spring, K(x) in eq. (1)",
    "small",
    "N",
    1.0,
    experiments=(STATIC, STEP, ANCHOR, WALK),
    equation=True,
)
