"""What the motion capture says, by the position: a lens that distorts."""

from bifa.problem.inputs import WALK, Inputs
from bifa.problem.sites.site import PLACE, Site
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant
from lacuna.system import Channels

SITE = Site("camera", "what the motion capture says", PLACE, "m", 0.002, experiments=(WALK,))
_SEEN = ("displacement_head", "displacement_tail")


def readings(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    return {name: mm + 1e3 * curve.at(1e-3 * mm) for name, mm in channels.items() if name.startswith(_SEEN)}
