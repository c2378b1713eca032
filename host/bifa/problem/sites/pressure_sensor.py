"""What the pressure sensors say, by the pressure."""

from bifa.problem.inputs import Inputs
from bifa.problem.sites.site import PRESSURE, Site, pressures
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant
from lacuna.system import Channels

SITE = Site("pressure_sensor", "what the pressure sensors say", PRESSURE, "psi", 0.1)


def readings(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    return {name: psi + curve.at(psi) for name, psi in pressures(channels)}
