"""The force of the body's damper, by velocity."""

from bifa.pipe_robot.inputs import STEP, WALK
from bifa.pipe_robot.sites.site import VELOCITY, Site

SITE = Site(
    "body_damper", "the body's damper, b v in eq. (1)", VELOCITY, "N", 1.0, experiments=(STEP, WALK), equation=True
)
