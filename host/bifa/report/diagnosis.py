"""The page of one diagnosis: verdict, evidence, error before and after, what to measure next."""

from collections.abc import Mapping, Sequence
from typing import Any

from bifa.report.evidence import errors_chart, learnt_chart
from bifa.report.page import ChartedSection, Page, PageTable
from bifa.report.words import (
    effect_parameter,
    effect_words,
    experiment_words,
    gait_words,
    parameter_words,
    plain,
    quantity,
    spoken,
    unit_of,
)
from bifa.robot.parameters import BASE_PARAMETERS
from lacuna.report.sentence import own_form
from lacuna.report.sentence import verdict_sentence as engine_sentence

BASE_MODEL = "The base model is the paper's, with its parameters fitted to this robot."
COMPLETED_MODEL = "The completed model includes the effects that were found, and was refitted."
RMS = "Errors are measured minus predicted, as root mean square (RMS)."
RESIDUAL = "A residual is the measurement minus the prediction."
NOISE_FLOOR = "The noise floor is how much runs of the same condition differ: no model can predict better."
LOWERED = (
    "If a named effect explains part of that (such as a ripple with another phase in every run), the floor is lowered."
)
HELD_OUT = "Held-out trials were measured, but neither model was fitted to them."

Labels = Mapping[str, str]


def verdict_sentence(record: Mapping[str, Any]) -> str:
    """Return the engine's sentence on the verdict in a record of `bifa diagnose --json` or in a campaign's summary,
    with effects and their sizes in words."""
    verdict, effects, remainder = (record[key] for key in ("verdict", "effects", "remainder"))
    tried = [{**near, "effects": [effect_words(n) for n in near["effects"]]} for near in record.get("nearest", ())]
    return engine_sentence(verdict, effects, remainder, lambda one: effect_words(one["name"], one["parameters"]), tried)


def diagnosis_page(
    name: str, record: Mapping[str, Any], labels: Labels | None = None, curves: Sequence[ChartedSection] = ()
) -> Page:
    """Make the page for a record of `bifa diagnose --json`. `labels` names the trials by file; `curves`: sections that
    compare measurements with the models' predictions."""
    return Page(
        f"Diagnosis of {name}",
        verdict_sentence(record),
        [*lacking(record, labels), *further(record, labels), *curves],
        (f"{BASE_MODEL} {COMPLETED_MODEL} {RMS} {NOISE_FLOOR} {LOWERED} {HELD_OUT}",),
        (noise_table(record["error"]),),
    )


def lacking(record: Mapping[str, Any], labels: Labels | None = None) -> list[ChartedSection]:
    """Sections on what was found, and on the errors of both models."""
    effects = record["effects"]
    found = [ChartedSection("What was found", found_sentences(effects), (effects_table(effects),))] if effects else []
    return [
        *found,
        ChartedSection("Where the base model is off", (RESIDUAL, spoken(record["signature"]["text"], labels))),
        ChartedSection("Error before and after", charts=[errors_chart(record["error"])]),
    ]


def found_sentences(effects: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences on how much each effect explains, its weight, and what else it could be."""
    said = ["The gap is the base model's error beyond the noise floor, on held-out trials."]
    for effect in effects:
        name = effect_words(effect["name"])
        share = effect["share_of_gap"]
        closes = "explains what repeats do not share" if share is None else f"closes {_percent(share)} of it"
        sentence = f"{name[:1].upper()}{name[1:]} {closes}"
        if effect["probability"] is not None:
            sentence += f"; its weight is {effect['probability']:.2f}"
        if effect["confusable_with"]:
            others = " or ".join(effect_words(other) for other in effect["confusable_with"])
            sentence += f", and this data cannot tell it from {others}"
        if form := own_form(effect):
            sentence += f"; it acts {form}"
        said.append(f"{sentence}.")
    return said


def further(record: Mapping[str, Any], labels: Labels | None = None) -> list[ChartedSection]:
    """Sections on what is left, what else was tried, caveats, and what to measure next; empty ones are left out."""
    learnt, coming = record["learnt"], record["next_experiment"]
    said = [f"Added to the model: {curve['term']}, a curve over {curve['variable']}." for curve in learnt]
    left = [spoken(record["remainder"]["text"], labels)] if record["effects"] else []
    hidden = ", ".join(effect_words(name) for name in record["not_detectable_here"])
    separated = " from ".join(effect_words(name) for name in coming["separates"])
    next_one = f"A further experiment would tell {separated}: {settings_words(coming)}." if coming["experiment"] else ""
    sections = (
        ChartedSection("Learnt from the data", said, charts=[learnt_chart(curve) for curve in learnt]),
        ChartedSection("What the named effects leave", left),
        ChartedSection("Parameters of the base model", tables=base_table(record)),
        ChartedSection("Also tried", tables=nearest_table(record)),
        ChartedSection("Before you believe it", [spoken(line, labels) for line in record["warnings"]]),
        ChartedSection("Not detectable in this data", [f"{hidden}."] if hidden else []),
        ChartedSection("Next experiment", [next_one] if next_one else []),
    )
    return [section for section in sections if section.paragraphs or section.tables]


def effects_table(effects: Sequence[Mapping[str, Any]], truth: Mapping[str, Any] | None = None) -> PageTable:
    """Tabulate the parameters of every effect with their intervals; `truth` adds the sealed values."""
    rows = []
    found = {effect["name"]: effect for effect in effects}
    for name in dict.fromkeys([*found, *(truth or {})]):
        mine, true = found.get(name), (truth or {}).get(name, {})
        for key in dict.fromkeys([*(mine["parameters"] if mine else ()), *true]):
            meaning, unit = effect_parameter(name, key)
            value, ends = "not found", ""
            if mine is not None:
                value, (low, high) = quantity(mine["parameters"][key], unit, 3), mine["interval_90"][key]
                ends = "" if None in (low, high) else f"{quantity(low, unit, 3)} to {quantity(high, unit, 3)}"
            sealed = quantity(true[key], unit, 3) if key in true else "absent"
            rows.append([f"{effect_words(name)}: {meaning}", value, ends, *([sealed] if truth is not None else [])])
    columns = ["", "found", "90 % interval", *(["sealed value"] if truth is not None else [])]
    return PageTable(columns, rows or [["no effect", *[""] * (len(columns) - 1)]])


def base_table(record: Mapping[str, Any]) -> list[PageTable]:
    """Tabulate the base model's parameters, fitted jointly with the named effects; no table if data are unexplained."""
    rows = []
    for name, one in record["base_parameters"].items():
        if name in BASE_PARAMETERS:  # not the coefficients of a curve's shape
            ends = "" if None in one["interval_90"] else " to ".join(plain(end, 4) for end in one["interval_90"])
            rows.append((parameter_words(name), plain(one["value"], 4), ends, BASE_PARAMETERS[name].unit))
    return [PageTable(("", "value", "90 % interval", "unit"), rows)] if rows else []


def nearest_table(record: Mapping[str, Any]) -> list[PageTable]:
    """Tabulate explanations that were not chosen, and the share of the gap that each closes; no table if none."""
    rows = [
        (" and ".join(effect_words(name) for name in near["effects"]), _percent(near["share_of_gap"]))
        for near in sorted(record["nearest"], key=lambda near: -(near["share_of_gap"] or 0.0))
    ]
    return [PageTable(("explanation", "of the gap that it alone would close"), rows)] if rows else []


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100 * min(share, 1.0):.0f} %" if share >= 0.005 else "under 1 %"


def noise_table(error: Mapping[str, Any]) -> PageTable:
    """Tabulate errors before and after, of fitted and held-out trials and by experiment, with the noise floor."""
    labels = {"fitted": "fitted", "held_out": "held-out", "held_out_conditions": "held-out, new conditions"}
    sides = ("before", "after", "noise_floor")
    here = {what: label for what, label in labels.items() if error["before"].get(what) is not None}
    rows = [[label, *(_noise(error[side].get(what)) for side in sides)] for what, label in here.items()]
    for name in error["before"]["by_experiment"]:
        rows.append([experiment_words(name), *(_noise(error[s]["by_experiment"].get(name)) for s in sides[:2]), ""])
    columns = ["RMS error, in units of the noise floor", "base model", "completed model", "noise floor"]
    return PageTable(columns, rows, strong_row=1)


def _noise(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"


def settings_words(experiment: Mapping[str, Any]) -> str:
    """Return the settings of an experiment in words, such as "static loading, large, 4 psi, 2 mm/s"."""
    said = [experiment_words(experiment["experiment"])]
    for name, value in experiment["settings"].items():
        if isinstance(value, Mapping):
            said.append(gait_words(value))
        elif isinstance(value, float | int):
            unit = "mm/s" if name.endswith("_mm_s") else unit_of(name)
            said.append(f"pipe at {value:g} degrees" if name == "inclination_deg" else f"{value:g} {unit}")
        else:
            said.append(str(value))
    return ", ".join(said)
