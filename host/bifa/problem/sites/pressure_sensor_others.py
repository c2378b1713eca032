"""What the pressure sensors say by the pressure of each other chamber: crosstalk."""

from bifa.problem.inputs import WALK, Inputs, WalkInputs
from bifa.problem.sites.site import PRESSURE, Site
from bifa.robot.cpg import CHAMBERS
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant
from lacuna.system import Channels

_PAIRS = tuple((mine, other) for mine in range(3) for other in range(3) if mine != other)

SITE = Site(
    "pressure_sensor_others",
    "what the pressure sensors say by the pressure of each other chamber",
    PRESSURE,
    "psi",
    0.1,
    rows=tuple(f"{CHAMBERS[mine]} by {CHAMBERS[other]}" for mine, other in _PAIRS),
    experiments=(WALK,),
)


def readings(channels: Channels, curve: LearntCurve, inputs: Inputs, plant: Plant) -> Channels:
    if not isinstance(inputs, WalkInputs):
        return {}
    psi = [channels[f"pressure_{chamber}_psi"] for chamber in CHAMBERS]
    found = {}
    for mine, chamber in enumerate(CHAMBERS):
        rows = [(row, other) for row, (one, other) in enumerate(_PAIRS) if one == mine]
        found[f"pressure_{chamber}_psi"] = psi[mine] + sum(curve.at(psi[other], row) for row, other in rows)
    return found
