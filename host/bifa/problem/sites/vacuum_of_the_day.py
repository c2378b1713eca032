"""The vacuum, as the day goes on."""

from bifa.problem.inputs import STEP, WALK
from bifa.problem.sites.site import DAY, Site
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant, layout

SITE = Site("vacuum_of_the_day", "the vacuum, as the day goes on", DAY, "psi", 0.1, experiments=(STEP, WALK))


def plant(plant: Plant, curve: LearntCurve, place: float) -> Plant:
    q = plant.q.copy()
    q[layout.SUPPLY_NEGATIVE] += curve.at(place)
    return plant._replace(q=q)
