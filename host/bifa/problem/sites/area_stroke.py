"""The area, by the share of the stroke."""

from bifa.problem.sites.site import Range, Site

SITE = Site(
    "area_stroke",
    "the area a of eq. (2), by the share of the stroke",
    Range("share of the stroke", 0.0, 1.0),
    "",
    0.01,
    equation=True,
)
