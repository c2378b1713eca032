"""The force of the large actuator's spring while it is loaded slowly, by direction: what it remembers of its way."""

from bifa.problem.inputs import STATIC, Inputs
from bifa.problem.sites.site import Site, loading
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant
from lacuna.system import Channels

SITE = Site(
    "body_loading",
    "force of the large actuator's spring while it is loaded slowly, by direction",
    "body",
    "N",
    1.0,
    rows=("extending", "contracting"),
    experiments=(STATIC,),
)


def readings(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    return loading(channels, curve, inputs, "large")
