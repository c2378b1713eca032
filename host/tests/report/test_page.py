"""The report page: self-contained, escaped, readable in both colour schemes."""

import re

import numpy as np

from bifa.report.animation import animate_walk
from lacuna.report.evidence import draw_errors, draw_probabilities
from lacuna.report.page import Page, Section, Table, both_palettes, render

ERROR = {
    "before": {"fitted": 21.3, "held_out": 20.8, "by_experiment": {"static_loading": 27.3, "step_response": 11.5}},
    "after": {"fitted": 1.02, "held_out": 1.05, "by_experiment": {"static_loading": 1.0, "step_response": 1.01}},
    "noise_floor": {"fitted": 1.0, "held_out": 1.0},
}
EFFECTS = [{"name": "hysteresis", "parameters": {}, "probability": 0.97, "confusable_with": ["viscoelasticity"]}]


def walk_columns():
    time_s = np.arange(0, 12, 0.01)
    return {
        "time_s": time_s,
        "displacement_head_mm": 10 * time_s,
        "displacement_tail_mm": 10 * time_s - 2,
    } | {f"pressure_{name}_psi": 10 * np.sin(time_s) for name in ("body", "head", "tail")}


def page():
    return Page(
        "Bench <today>",
        "The spring has hysteresis.",
        [("0.97", "probability")],
        [
            Section("Motion", svg=animate_walk(walk_columns(), 5.0, "the robot walks")),
            Section(
                "Error",
                ["a & b"],
                tables=[Table(["gait", "speed"], [["<b>baseline</b>", "10.8"]], "mm/s", strong_row=0)],
                figures=[
                    both_palettes(lambda stream, dark: draw_errors(ERROR, stream, dark), "errors", "before and after"),
                    both_palettes(lambda stream, dark: draw_probabilities(EFFECTS, stream, dark), "probabilities"),
                ],
            ),
        ],
        "made by bifa",
    )


def test_the_page_needs_no_network_and_no_script():
    html = render(page())
    assert "<script" not in html
    references = re.findall(r'(?:src|href|srcset)="([^"]*)"', html)
    assert len(references) == 4
    assert all(reference.startswith("data:image/png;base64,") for reference in references)


def test_text_is_escaped_and_both_palettes_are_there():
    html = render(page())
    assert "Bench &lt;today&gt;" in html
    assert "&lt;b&gt;baseline" in html
    assert "a &amp; b" in html
    light, dark = re.findall(r'(?:src|srcset)="([^"]*)"', html)[:2]
    assert light != dark


def test_the_animation_moves_as_the_record_does():
    svg = animate_walk(walk_columns(), 5.0, "walk")
    tail = re.search(r'attributeName="x" values="([^"]*)"', svg).group(1).split(";")
    assert float(tail[-1]) - float(tail[0]) == np.float64(2.0 * 10 * (len(tail) - 1) / 20).round(1)


def test_the_page_is_the_same_bytes_every_time():
    assert render(page()) == render(page())
