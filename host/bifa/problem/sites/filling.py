"""The rate of a chamber's pressure, by that pressure; while it fills, and while it empties."""

from bifa.problem.inputs import STEP, WALK
from bifa.problem.sites.site import PRESSURE, Site

SITE = Site(
    "filling",
    "rate of a chamber's pressure, eq. (2)",
    PRESSURE,
    "psi/s",
    0.3,
    rows=("filling", "emptying"),
    experiments=(STEP, WALK),
    equation=True,
)
