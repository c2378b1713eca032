"""A verdict as one screen of text, and the origin of the noise floor in words."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.report.sentence import (
    next_in_words,
    number_in_words,
    own_form,
    share_in_words,
    shares_in_words,
    verdict_sentence,
)

_WIDTH, _LINES = 100, 40
_WARNINGS, _TRIED = 6, 4


def screen_of(name: str, record: Mapping[str, Any], diagnosis: Diagnosis) -> str:
    """Return the verdict as at most `_LINES` lines of at most `_WIDTH` characters."""
    sentence = verdict_sentence(record["verdict"], record["effects"], record["remainder"], nearest=record["nearest"])
    lines = [f"{name}: {record['verdict']}", *_wrapped(sentence), ""]
    lines += _effects(record)
    lines += _errors(record["error"])
    lines += _wrapped(floor_sentence(diagnosis))
    lines.append("")
    for said in (*_where(record), *_more(record, diagnosis.final.structure.effects)):
        lines += _wrapped(said)
    warnings = record["warnings"]
    lines += [line for one in warnings[:_WARNINGS] for line in _wrapped(one, "! ")]
    if len(warnings) > _WARNINGS:
        lines.append(f"! and {len(warnings) - _WARNINGS} more: verdict.warnings")
    return "\n".join(lines if len(lines) <= _LINES else [*lines[: _LINES - 1], "... all of it: verdict.report(...)"])


def _where(record: Mapping[str, Any]) -> Iterator[str]:
    """Say where the residual lies: that of the base model or, for a verdict `identified`, what the effects leave,
    preceded by the former if there was no gap."""
    lacking = record["signature"]["text"]
    if record["verdict"] != "identified":
        yield lacking
        return
    if record["remainder"]["share_of_gap"] is None:
        yield f"What was missing: {lacking}"
    yield f"What is left: {record['remainder']['text']}"


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


def _more(record: Mapping[str, Any], effects: Sequence[str]) -> Iterator[str]:
    """Say what else the completed model contains (`effects`, learnt curves), what was tried, and what to do next."""
    if record["verdict"] == "unexplained" and effects:
        yield f"In the errors after and in the completed model, though not named: {', '.join(effects)}."
    if curves := record["learnt"]:
        added = " and ".join(f"{curve['term']} over {curve['variable']}" for curve in curves)
        one = "a learnt curve" if len(curves) == 1 else "learnt curves"
        yield f"In the errors after and in the completed model: {one}, {added}."
    near = record["nearest"][:_TRIED] if record["verdict"] != "none" else []
    if all(one["share_of_gap"] is None for one in near) and near:
        yield f"Also tried: {', '.join(' + '.join(r['effects']) for r in near)}."
    elif near:
        pairs = zip(near, shares_in_words(near), strict=True)
        each = (f"{' + '.join(r['effects'])} ({share})" for r, share in pairs)
        yield f"Also tried, with what each would close: {', '.join(each)}."
    if hidden := record["not_detectable_here"]:
        yield f"These data would hardly show: {', '.join(hidden)}."
    if coming := next_in_words(record["next_experiment"]):
        yield f"Next: {coming}"


def floor_sentence(diagnosis: Diagnosis) -> str:
    """Say where the floor comes from and, for channels without repeats, what that implies."""
    channels = diagnosis.search.floor.channels
    repeats = sum(noise.repeats for noise in channels.values())
    alone = sorted({channel for (_, channel), noise in channels.items() if not noise.repeats})
    if not alone:
        return f"The floor comes from the differences between {pairs_in_words(repeats)}."
    time_s = diagnosis.base.structure.system.noise_time_s
    told = {c: seconds for c in alone if (seconds := max(time_s(*key) for key in channels if key[1] == c))}
    if len(told) == len(alone):
        listed = ", ".join(f"{seconds:.3g} s of {channel}" for channel, seconds in told.items())
        return (
            f"Without repeats the floor is how much residuals change within the noise's correlation time ({listed});"
            " whatever varies that fast counts as noise here, whatever is slower as structure."
        )
    return (
        f"Without repeats the floor of {', '.join(alone)} is the fast noise of the residual: whatever varies slowly"
        " from run to run counts as structure here, and only a repeat could show that it is not."
    )


def pairs_in_words(count: int) -> str:
    """Say how many pairs of repeats there are."""
    return "one pair of repeats" if count == 1 else f"{count} pairs of repeats"
