"""The page of one diagnosis: verdict, evidence, error before and after, what to measure next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.report.evidence import draw_errors, draw_learnt, draw_probabilities
from lacuna.report.measured import floor_sentence, measured_rows
from lacuna.report.overview import draw_held_out, draw_tried
from lacuna.report.page import Page, Section, Table, both_palettes


def verdict_sentence(verdict: str, effects: Sequence[Mapping[str, Any]], remainder: Mapping[str, Any]) -> str:
    """A verdict (of `as_record`) in one sentence."""
    if verdict == "none":
        return "Nothing that matters is missing from the base model: it predicts these data to within the noise."
    if verdict == "unexplained":
        return "The base model lacks something that no effect of the library explains."
    names = _names([effect["name"] for effect in effects])
    closed = f"{100 * (1 - remainder['share_of_gap']):.0f} % of the gap"
    rest = "; what is left still matters" if remainder["matters"] else "; nothing that matters is left"
    return f"What the base model lacks is {names}, which closes {closed}{rest}."


def diagnosis_page(name: str, record: Mapping[str, Any], found: Diagnosis | None = None) -> Page:
    """The page for a `record` (of `as_record`); with the diagnosis itself also what was measured, and traces."""
    error, effects = record["error"], record["effects"]
    lead = verdict_sentence(record["verdict"], effects, record["remainder"])
    facts = [
        (f"{error['before']['held_out']:.2f}", "error of the base model on trials not fitted, in units of the noise"),
        (f"{error['after']['held_out']:.2f}", "after"),
        (f"{error['noise_floor']['held_out']:.2f}", "noise floor"),
    ]
    errors = both_palettes(
        lambda stream, dark: draw_errors(error, stream, dark), "error before and after by experiment, on a log axis"
    )
    sections = [
        Section("Where the residual is", (record["signature"]["text"],)),
        Section("Error before and after", figures=(errors,)),
    ]
    if found is not None:
        sections[:0] = [_measured(found)]
        figure = both_palettes(
            lambda stream, dark: draw_held_out(found, stream, dark),
            "measured and predicted, before and after, on records that were not fitted",
            "The records that the base model predicts worst. Left: measured and predicted; right: the residual.",
        )
        sections.append(Section("On records that were not fitted", figures=(figure,)))
    if effects:
        evidence = both_palettes(
            lambda stream, dark: draw_probabilities(effects, stream, dark), "probability of each effect named"
        )
        rows = [
            (effect["name"].replace("_", " "), _sized(effect), f"{100 * effect['share_of_gap']:.0f} %")
            for effect in effects
        ]
        table = Table(("effect", "parameters, with 90 % intervals", "of the gap"), rows)
        sections.insert(0, Section("Evidence", tables=(table,), figures=(evidence,)))
        sections.append(Section("What the named effects leave", (record["remainder"]["text"],)))
    if record["nearest"]:
        rows = [
            (" + ".join(r["effects"]).replace("_", " "), f"{100 * r['share_of_gap']:.0f} %") for r in record["nearest"]
        ]
        table = Table(("explanation", "of the gap that it would close"), rows)
        tried = both_palettes(lambda stream, dark: draw_tried(record, stream, dark), "what each explanation leaves")
        why = (
            "An explanation is rejected if it predicts conditions that were never fitted no better than a smaller one,"
            " if it closes too little of the gap, or if a rival explains the same and more."
        )
        sections.append(Section("Also tried, and rejected", (why,), (table,), (tried,)))
    if record["warnings"]:
        sections.append(Section("Before you believe it", tuple(record["warnings"])))
    for curve in record["learnt"]:
        text = f"Added to the model: a curve for {curve['term']}."
        figure = both_palettes(
            lambda stream, dark, curve=curve: draw_learnt(curve, stream, dark), f"the curve over {curve['variable']}"
        )
        sections.append(Section("Learnt from the data", (text,), figures=(figure,)))
    hidden = record["not_detectable_here"]
    if hidden:
        sections.append(Section("Not detectable in this data", (", ".join(hidden),)))
    indistinct = [(e["name"], ", ".join(e["confusable_with"])) for e in effects if e["confusable_with"]]
    if indistinct:
        sections.append(Section("What this data cannot tell", tables=(Table(("named", "could be"), indistinct),)))
    coming = record["next_experiment"]
    if coming["experiment"]:
        settings = ", ".join(f"{k} {v}" for k, v in coming["settings"].items())
        text = f"{coming['experiment']} ({settings}) would separate {', '.join(coming['separates'])}."
        sections.append(Section("Next experiment", (text,)))
    return Page(f"Diagnosis of {name}", lead, facts, sections)


def _measured(found: Diagnosis) -> Section:
    columns = ("channel", "records in conditions", "floor (standard deviation)", "samples per observation", "from")
    return Section("What was measured", (floor_sentence(found),), (Table(columns, measured_rows(found)),))


def _sized(effect: Mapping[str, Any]) -> str:
    ends = effect["interval_90"]
    return ", ".join(f"{k} = {v:g} ({ends[k][0]:g} to {ends[k][1]:g})" for k, v in effect["parameters"].items())


def _names(effects: Sequence[str]) -> str:
    return " and ".join(effects).replace("_", " ")
