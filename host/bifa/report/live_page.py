"""The document of the live page; `bifa.live.web` serves it."""

from __future__ import annotations

from bifa.link.table import CHAMBERS
from bifa.report.page import environment, page_style, template_file
from bifa.report.plot import library_script
from bifa.report.style import PALETTES

_SLIDERS = (
    ("period_s", "period", "s", 0.01),
    ("psi12_deg", "head ahead of the body", "°", 0.5),
    ("psi13_deg", "tail ahead of the body", "°", 0.5),
    ("duty_body", "body at vacuum", "of the cycle", 0.005),
    ("duty_head", "head at vacuum", "of the cycle", 0.005),
    ("duty_tail", "tail at vacuum", "of the cycle", 0.005),
)


def live_page() -> str:
    """One HTML document; what it shows and asks goes to where it came from."""
    return (
        environment()
        .get_template("live.html.jinja")
        .render(
            palettes=PALETTES,
            chambers=CHAMBERS,
            sliders=_SLIDERS,
            style=page_style() + template_file("live.css"),
            script=template_file("live.js"),
            library=library_script(),
        )
    )
