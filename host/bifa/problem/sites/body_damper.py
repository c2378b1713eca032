"""The force of the body's damper, by velocity."""

from bifa.problem.inputs import STEP, WALK
from bifa.problem.sites.site import VELOCITY, Site

SITE = Site(
    "body_damper", "the body's damper, b v in eq. (1)", VELOCITY, "N", 1.0, experiments=(STEP, WALK), equation=True
)
