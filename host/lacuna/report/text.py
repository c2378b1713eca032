"""A verdict as a screen of text."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.report.measured import floor_sentence
from lacuna.report.sentence import number_in_words, own_form, share_in_words, verdict_sentence

_WIDTH, _LINES = 100, 40
_WARNINGS, _TRIED = 6, 4


def screen_of(name: str, record: Mapping[str, Any], diagnosis: Diagnosis) -> str:
    """At most `_LINES` lines of at most `_WIDTH` characters."""
    lines = [f"{name}: {record['verdict']}", *_wrapped(_sentence(record)), ""]
    lines += _effects(record)
    lines += _errors(record["error"])
    lines += _wrapped(floor_sentence(diagnosis))
    lines += ["", *_where(record)]
    lines += _unnamed(record["verdict"], diagnosis.final.structure.effects)
    lines += _learnt(record["learnt"])
    lines += _nearest(record)
    lines += _unseen(record["not_detectable_here"])
    lines += _next(record["next_experiment"])
    warnings = record["warnings"]
    lines += [line for one in warnings[:_WARNINGS] for line in _wrapped(one, "! ")]
    if len(warnings) > _WARNINGS:
        lines.append(f"! and {len(warnings) - _WARNINGS} more: verdict.warnings")
    return "\n".join(lines if len(lines) <= _LINES else [*lines[: _LINES - 1], "... all of it: verdict.report(...)"])


def _sentence(record: Mapping[str, Any]) -> str:
    return verdict_sentence(record["verdict"], record["effects"], record["remainder"], nearest=record["nearest"])


def _where(record: Mapping[str, Any]) -> Iterator[str]:
    """Where what is missing shows: of an explanation what it leaves, and first where that was if no error showed it."""
    lacking = record["signature"]["text"]
    if record["verdict"] != "identified":
        yield from _wrapped(lacking)
        return
    if record["remainder"]["share_of_gap"] is None:
        yield from _wrapped(f"What was missing: {lacking}")
    yield from _wrapped(f"What is left: {record['remainder']['text']}")


def _wrapped(text: str, mark: str = "") -> list[str]:
    return textwrap.wrap(text, _WIDTH, initial_indent=mark, subsequent_indent=" " * len(mark))


def _effects(record: Mapping[str, Any]) -> Iterator[str]:
    for effect in record["effects"]:
        share = effect["share_of_gap"]
        closes = "" if share is None else f"closes {share_in_words(share)}, "
        yield f"{effect['name']}: {closes}weight {effect['probability']:.2f}"
        if form := own_form(effect):
            yield from _wrapped(form, "    ")
        for name, value in effect["parameters"].items():
            lower, upper = (number_in_words(end) for end in effect["interval_90"][name])
            yield f"    {name} = {number_in_words(value)}   ({lower} to {upper})"
        if effect["confusable_with"]:
            yield f"    this data cannot tell it from {', '.join(effect['confusable_with'])}"
    if record["effects"]:
        yield ""


def _errors(error: Mapping[str, Any]) -> Iterator[str]:
    yield f"{'RMS error in units of the noise':42}{'before':>10}{'after':>10}{'floor':>10}"
    for side, label in (
        ("fitted", "records fitted"),
        ("held_out", "not fitted"),
        ("held_out_conditions", "conditions not fitted"),
    ):
        if error["before"][side] is not None:
            values = (error[column][side] for column in ("before", "after", "noise_floor"))
            yield f"  {label:40}" + "".join(f"{number_in_words(v):>10}" for v in values)


def _unnamed(verdict: str, effects: Sequence[str]) -> list[str]:
    if verdict != "unexplained" or not effects:
        return []
    return _wrapped(f"In the errors after and in the completed model, though not named: {', '.join(effects)}.")


def _learnt(curves: Sequence[Mapping[str, Any]]) -> list[str]:
    if not curves:
        return []
    added = " and ".join(f"{curve['term']} over {curve['variable']}" for curve in curves)
    one = "a learnt curve" if len(curves) == 1 else "learnt curves"
    return _wrapped(f"In the errors after and in the completed model: {one}, {added}.")


def _nearest(record: Mapping[str, Any]) -> list[str]:
    if record["verdict"] == "none" or not record["nearest"]:
        return []
    near = record["nearest"][:_TRIED]
    if near[0]["share_of_gap"] is None:
        return _wrapped(f"Also tried: {', '.join(' + '.join(r['effects']) for r in near)}.")
    each = (f"{' + '.join(r['effects'])} ({share_in_words(r['share_of_gap'])})" for r in near)
    return _wrapped(f"Also tried, with what each would close: {', '.join(each)}.")


def _unseen(effects: Sequence[str]) -> list[str]:
    return _wrapped(f"These data would hardly show: {', '.join(effects)}.") if effects else []


def _next(coming: Mapping[str, Any]) -> list[str]:
    if not coming["experiment"]:
        return []
    settings = ", ".join(f"{k} {v}" for k, v in coming["settings"].items())
    return _wrapped(f"Next: {coming['experiment']} ({settings}) would separate {', '.join(coming['separates'])}.")
