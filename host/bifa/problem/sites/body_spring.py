"""The force of the large actuator's spring, over its stroke."""

from bifa.problem.inputs import STATIC, STEP, WALK
from bifa.problem.sites.site import Site

SITE = Site(
    "body_spring",
    "force of the large actuator's spring, K(x) in eq. (1)",
    "body",
    "N",
    1.0,
    experiments=(STATIC, STEP, WALK),
    equation=True,
)
