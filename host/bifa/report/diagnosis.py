"""The page of one diagnosis: verdict, evidence, error before and after, what to measure next."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bifa.report.evidence import draw_errors, draw_learnt, draw_probabilities
from bifa.report.page import Page, Section, Table, both_palettes

_LEADS = {
    "none": "The base model explains this data: what is left differs as repeats of one run do.",
    "unexplained": "Something is left that no effect of the library accounts for.",
}


def diagnosis_page(name: str, record: Mapping[str, Any]) -> Page:
    """The page for a record of `bifa diagnose --json`."""
    error, effects = record["error"], record["effects"]
    lead = _LEADS.get(record["verdict"]) or "What the base model lacks: " + ", ".join(
        effect["name"].replace("_", " ") for effect in effects
    )
    facts = [
        (f"{error['before']['held_out']:.2f}", "held-out error of the base model, in units of the noise"),
        (f"{error['after']['held_out']:.2f}", "after"),
        (f"{error['noise_floor']['held_out']:.2f}", "noise floor"),
    ]
    errors = both_palettes(
        lambda stream, dark: draw_errors(error, stream, dark), "error before and after by experiment, on a log axis"
    )
    sections = [
        Section("Where the residual lives", (record["signature"]["text"],)),
        Section("Error before and after", figures=(errors,)),
    ]
    if effects:
        evidence = both_palettes(
            lambda stream, dark: draw_probabilities(effects, stream, dark), "probability of each effect named"
        )
        rows = [
            (effect["name"], ", ".join(f"{k} = {v:g}" for k, v in effect["parameters"].items())) for effect in effects
        ]
        sections.insert(0, Section("Evidence", tables=(Table(("effect", "parameters"), rows),), figures=(evidence,)))
    for curve in record["learnt"]:
        text = f"Added to the model: a curve for {curve['term']}."
        figure = both_palettes(
            lambda stream, dark, curve=curve: draw_learnt(curve, stream, dark), f"the curve over {curve['variable']}"
        )
        sections.append(Section("Learnt from the data", (text,), figures=(figure,)))
    hidden = record["not_detectable_here"]
    if hidden:
        sections.append(Section("Not detectable with this data", (", ".join(hidden),)))
    coming = record["next_experiment"]
    if coming["experiment"]:
        settings = ", ".join(f"{k} {v}" for k, v in coming["settings"].items())
        text = f"{coming['experiment']} ({settings}) would separate {', '.join(coming['separates'])}."
        sections.append(Section("Next experiment", (text,)))
    return Page(f"Diagnosis of {name}", lead, facts, sections)
