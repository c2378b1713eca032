"""The area, as the day goes on."""

from bifa.problem.sites.site import DAY, Site
from bifa.robot.learnt import LearntCurve
from bifa.simulate import Plant, layout

SITE = Site("area_of_the_day", "the area a of eq. (2), as the day goes on", DAY, "", 0.01)


def plant(plant: Plant, curve: LearntCurve, place: float) -> Plant:
    q = plant.q.copy()
    q[[layout.BODY + layout.AREA, layout.SMALL + layout.AREA]] *= 1.0 + curve.at(place)
    return plant._replace(q=q)
