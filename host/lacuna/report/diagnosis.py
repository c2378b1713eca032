"""HTML page of one diagnosis: verdict, evidence, errors before and after, and the next experiment."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.report.figures import draw_errors, draw_held_out, draw_learnt, draw_tried, draw_weights
from lacuna.report.page import Page, PageTable, Section, both_palettes
from lacuna.report.sentence import (
    next_in_words,
    number_in_words,
    own_form,
    share_in_words,
    shares_in_words,
    verdict_sentence,
)
from lacuna.report.text import floor_sentence, pairs_in_words
from lacuna.system import by_channel


def diagnosis_page(name: str, record: Mapping[str, Any], found: Diagnosis | None = None) -> Page:
    """Return the page for a `record` (from `as_record`), with measurements and traces if `found` is given."""
    error, effects = record["error"], record["effects"]
    meanings = {
        "before": "error of the base model on trials not fitted, in units of the noise",
        "after": "after",
        "noise_floor": "noise floor",
    }
    facts = [(number_in_words(error[side]["held_out"], ".2f"), meaning) for side, meaning in meanings.items()]
    sections = [
        *_evidence(effects),
        *([_measured(found)] if found else []),
        Section("Where the residual is", (record["signature"]["text"],)),
        _errors(error),
        *([_held_out(found)] if found else []),
        *([Section("What the named effects leave", (record["remainder"]["text"],))] if effects else []),
        *_rejected(record),
        *([Section("Before you believe it", tuple(record["warnings"]))] if record["warnings"] else []),
        *(_learnt(curve) for curve in record["learnt"]),
        *_open(record),
    ]
    lead = verdict_sentence(record["verdict"], effects, record["remainder"], nearest=record["nearest"])
    return Page(f"Diagnosis of {name}", lead, sections, facts=facts)


def _evidence(effects: Sequence[Mapping[str, Any]]) -> list[Section]:
    if not effects:
        return []
    figure = both_palettes(partial(draw_weights, effects), "weight of each effect named")
    rows = [
        (", ".join(filter(None, (_words(e["name"]), own_form(e)))), _size_text(e), share_in_words(e["share_of_gap"]))
        for e in effects
    ]
    table = PageTable(("effect", "parameters, with 90 % intervals", "closes"), rows)
    return [Section("Evidence", tables=(table,), figures=(figure,))]


def _errors(error: Mapping[str, Any]) -> Section:
    figure = both_palettes(partial(draw_errors, error), "error before and after by experiment, on a log axis")
    return Section("Error before and after", figures=(figure,))


def _held_out(found: Diagnosis) -> Section:
    which = "records that were not fitted" if found.split.final else "all records, which were fitted"
    figure = both_palettes(
        partial(draw_held_out, found),
        f"measured and predicted, before and after, on {which}",
        "The records that the base model predicts worst. Left: measured and predicted; right: the residual.",
    )
    return Section(f"On {which}", figures=(figure,))


def _rejected(record: Mapping[str, Any]) -> list[Section]:
    if not record["nearest"]:
        return []
    near = record["nearest"]
    rows = [(_words(" + ".join(r["effects"])), share) for r, share in zip(near, shares_in_words(near), strict=True)]
    table = PageTable(("explanation", "would close"), rows)
    tried = both_palettes(partial(draw_tried, record), "what each explanation leaves")
    why = (
        "An explanation is rejected if it predicts conditions that were never fitted no better than a smaller one,"
        " if it closes too little of the gap, or if a rival explains the same and more."
    )
    return [Section("Also tried, and rejected", (why,), (table,), figures=(tried,))]


def _learnt(curve: Mapping[str, Any]) -> Section:
    text = f"Added to the model: a curve for {curve['term']}."
    figure = both_palettes(partial(draw_learnt, curve), f"the curve over {curve['variable']}")
    return Section("Learnt from the data", (text,), figures=(figure,))


def _open(record: Mapping[str, Any]) -> list[Section]:
    """Sections on effects that the data would not show or cannot distinguish, and on the next experiment."""
    sections = []
    if hidden := record["not_detectable_here"]:
        sections.append(Section("Not detectable in this data", (", ".join(hidden),)))
    if indistinct := [(e["name"], ", ".join(e["confusable_with"])) for e in record["effects"] if e["confusable_with"]]:
        sections.append(Section("What this data cannot tell", tables=(PageTable(("named", "could be"), indistinct),)))
    if coming := next_in_words(record["next_experiment"]):
        sections.append(Section("Next experiment", (coming,)))
    return sections


def _words(name: str) -> str:
    return name.replace("_", " ")


def _measured(found: Diagnosis) -> Section:
    columns = ("channel", "records in conditions", "floor (standard deviation)", "samples per observation", "from")
    rows = []
    for (experiment, channel), trials in by_channel(found.base.structure.system.trials).items():
        noise = found.search.floor.of(experiment, channel)
        conditions = len({t.condition for t in trials})
        basis = pairs_in_words(noise.repeats) if noise.repeats else "the fast noise of the residual"
        piece = f"{noise.samples_per_piece:.3g}"
        sd = f"{noise.sd:.3g}" + (f" at {noise.reading:.3g}, and grows with the reading" if noise.grows else "")
        rows.append((f"{experiment}: {channel}", f"{len(trials)} in {conditions}", sd, piece, basis))
    return Section("What was measured", (floor_sentence(found),), (PageTable(columns, rows),))


def _size_text(effect: Mapping[str, Any]) -> str:
    said = []
    for name, value in effect["parameters"].items():
        size, lower, upper = (number_in_words(v, "g") for v in (value, *effect["interval_90"][name]))
        said.append(f"{name} = {size} ({lower} to {upper})")
    return ", ".join(said)
