"""The friction's coefficients, as the day goes on."""

from bifa.problem.inputs import ANCHOR, WALK
from bifa.problem.sites.site import DAY, Site
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant, layout

SITE = Site(
    "friction_of_the_day", "the friction's coefficients, as the day goes on", DAY, "", 0.01, experiments=(ANCHOR, WALK)
)


def plant(plant: Plant, curve: LearntCurve, place: float) -> Plant:
    q = plant.q.copy()
    q[[layout.MU_S, layout.MU_K]] *= 1.0 + curve.at(place)
    return plant._replace(q=q)
