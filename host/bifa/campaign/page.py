"""The report page of a campaign: the answer first, then the evidence."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bifa.campaign.again import ROUNDS, Ending
from bifa.gait.settling import STANDING_MM_S
from bifa.report.animation import animate_walks
from bifa.report.chart import Chart
from bifa.report.diagnosis import (
    BASE_MODEL,
    COMPLETED_MODEL,
    HELD_OUT,
    LOWERED,
    NOISE_FLOOR,
    RESIDUAL,
    RMS,
    Labels,
    effects_table,
    found_sentences,
    further,
    noise_table,
    settings_words,
    verdict_sentence,
)
from bifa.report.evidence import BASE, COMPLETED, errors_chart, residual_charts, robustness_chart
from bifa.report.page import ChartedSection, Motion, Page, PageTable
from bifa.report.walks import MEASURED, Walk, walks_chart
from bifa.report.words import NBSP, channel_words, effect_words, gait_words, plain, spoken, unit_of

GAIT_NAMES = {
    "baseline": "baseline (the paper's)",
    "base": "found with the base model",
    "completed": "found with the completed model",
}
ERROR_COLUMNS = ("base model", "completed model", "noise floor")
WALKED_NAMES = GAIT_NAMES | {"edge": "at the edge of what is known"}
_STAND_INS = {"baseline": "baseline", "base": "the base model's"}
FILES = (
    ("bench/dataset.toml", "data set"),
    ("diagnosis.json", "verdict"),
    ("model-base.toml", "base model"),
    ("model-completed.toml", "completed model"),
    ("gait-base.toml", "gait of the base model"),
    ("gait-completed.toml", "gait of the completed model"),
    ("summary.json", "figures"),
    ("provenance.json", "provenance"),
)
_MIN_STANDING_SHARE = 0.1  # share of robots that do not walk from which the report says so
_LONGEST_S = 20.0  # of an animation


def campaign_page(
    summary: Mapping[str, Any],
    diagnosis: Mapping[str, Any],
    traces: Sequence[Mapping[str, Any]],
    walks: Mapping[str, Walk],
    labels: Labels,
    robot: str,
    made: Sequence[tuple[str, str]],
) -> Page:
    """Build the page of a campaign; summary, diagnosis and traces as in summary.json, diagnosis.json, residuals.json.

    walks: the first repeat of each gait, by the gait's name in the summary. robot: in words; made: date, command,
    versions.
    """
    verdict = verdict_sentence(summary)
    sections = [
        _findings_section(summary, diagnosis),
        _residuals_section(summary, diagnosis, traces, labels),
        *further(diagnosis, labels),
        walking(walks),
        _gaits_section(summary, walks),
        rounds_section(summary["rounds"]),
    ]
    return Page(
        f"What {robot} does that the paper's model does not",
        f"{verdict} {_speed_sentences(summary['gaits'])}",
        sections,
        (
            f"{BASE_MODEL} {COMPLETED_MODEL} {RMS} {NOISE_FLOOR} {LOWERED} {HELD_OUT}",
            "Speeds are those of the settled cycles; ± is the spread of the repeats.",
        ),
        (prediction_table(summary["prediction_error"], "held-out"), speed_table(summary["gaits"])),
        made,
        FILES,
    )


def _speed_sentences(gaits: Sequence[Mapping[str, Any]]) -> str:
    by_name = {gait["gait"]: gait for gait in gaits}
    base, baseline_mm_s = by_name["base"], by_name["baseline"]["measured"]
    own = [one for one in gaits if one["gait"] in ("completed", "edge") and not one.get("stand_in")]
    if not own:
        return "With the completed model, no gait was found with which enough robots walk."
    fastest = max(own, key=lambda one: one["measured"])
    compared = "while the baseline stands still"
    if baseline_mm_s >= STANDING_MM_S:
        compared = f"{fastest['measured'] / baseline_mm_s:.1f} times as fast as the baseline"
    return (
        f"The gait found with the completed model walks {fastest['measured']:.1f} mm/s, {compared}. "
        f"{_gain_sentence(base, fastest['measured'])}"
    )


def _gain_sentence(base: Mapping[str, Any], completed_mm_s: float) -> str:
    """What completing the model gained on this robot."""
    base_mm_s = base["measured"]
    if base.get("stand_in"):
        return "With the base model, no gait was found."
    if base_mm_s < STANDING_MM_S:
        return "With the gait found with the base model the robot stands still."
    gain = 100.0 * (completed_mm_s / base_mm_s - 1.0)
    if abs(gain) < 1.0:
        return "The gait found with the base model is as fast, within one per cent."
    return f"That is {abs(gain):.0f} % {'faster' if gain > 0 else 'slower'} than with the base model."


def _findings_section(summary: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> ChartedSection:
    effects, truth = summary["effects"], summary["truth"]
    said = found_sentences(effects) if effects else []
    for experiment in diagnosis.get("separated_by", []):
        apart = " from ".join(effect_words(name) for name in experiment["separates"])
        said.append(f"To tell {apart}, the bench ran a further experiment: {settings_words(experiment)}.")
    if truth is not None:
        said.append(
            "The virtual robot draws its own effect and keeps it sealed: it was recorded before any measurement and "
            "opened only after the verdict."
        )
    return ChartedSection("What was found", said, [effects_table(effects, truth)])


def _residuals_section(
    summary: Mapping[str, Any], diagnosis: Mapping[str, Any], traces: Sequence[Mapping[str, Any]], labels: Labels
) -> ChartedSection:
    return ChartedSection(
        "Where the base model is off, and what is left",
        [
            RESIDUAL,
            spoken(diagnosis["signature"]["text"], labels),
            "Millimetres, psi and newtons cannot be added, so errors of several quantities are combined in units of "
            "the noise floor: 1 is as good as a repeat.",
        ],
        [prediction_table(summary["prediction_error"]), noise_table(diagnosis["error"])],
        [errors_chart(diagnosis["error"]), *residual_charts(traces).values()],
    )


def walking(walks: Mapping[str, Walk]) -> ChartedSection:
    """The walk for which the base model has the largest error, as predicted and as measured."""
    walk = most_missed(walks)
    svg, seconds, rate = motion_of(walk)
    how_fast = "in real time" if round(rate, 1) == 1.0 else f"at {rate:.1f} times real time"
    said = (
        f"The {walk.title}, for which the base model has the largest error: as the base model predicts it, as the "
        "motion capture measured it, and as the completed model predicts it."
    )
    caption = f"To scale, {how_fast}; blue body, orange head, green tail. The dot is the clock."
    motion = Motion(svg, seconds, round(seconds * rate, 1), caption)
    return ChartedSection("The robot, walking", [said], motion=motion)


def most_missed(walks: Mapping[str, Walk]) -> Walk:
    """Return the walk at whose end the base model is furthest from the robot."""
    return max(walks.values(), key=lambda walk: abs(_miss_mm(walk, BASE)))


def motion_of(walk: Walk, standalone: bool = False) -> tuple[str, float, float]:
    """Animate a walk: return the SVG, its length in seconds, and its speed relative to real time."""
    lanes = {}
    for name in (BASE, MEASURED, COMPLETED):
        miss = "" if name == MEASURED else f", {_ahead(_miss_mm(walk, name))} at the end"
        lanes[f"{name}{miss}"] = walk.records[name]
    duration_s = float(np.ptp(walk.records[MEASURED]["time_s"]))
    seconds = min(duration_s, _LONGEST_S)
    title = f"Side view of the robot walking: {', '.join(lanes)}"
    return animate_walks(lanes, round(seconds, 2), title, standalone), round(seconds, 2), duration_s / seconds


def _miss_mm(walk: Walk, name: str) -> float:
    """Distance in mm by which a model is ahead of the robot at the end of the walk."""
    return float(walk.records[name]["displacement_head_mm"][-1] - walk.records[MEASURED]["displacement_head_mm"][-1])


def _ahead(miss_mm: float) -> str:
    if abs(miss_mm) < 0.05:
        return "level with it"
    return f"{abs(miss_mm):.1f} mm {'ahead' if miss_mm > 0 else 'behind'}"


def _gaits_section(summary: Mapping[str, Any], walks: Mapping[str, Walk]) -> ChartedSection:
    robots = len(next(iter(summary["robustness"].values())))
    standing = {name: np.mean(np.asarray(speeds) < STANDING_MM_S) for name, speeds in summary["robustness"].items()}
    said = [
        "The commands of each gait to the three chambers (filled: positive supply; blank: vacuum), the resulting "
        "pressures and the displacement of the head, over the same time for every gait.",
    ]
    said += [
        f"On robots almost identical to this one the {walks[name].title} often does not walk at all: "
        f"{100 * share:.0f} % of {robots} robots whose parameters differ by 2 % stay below {STANDING_MM_S:g} mm/s."
        for name, share in standing.items()
        if share >= _MIN_STANDING_SHARE
    ]
    rows = []
    for name, speeds in summary["robustness"].items():
        median, least = np.median(speeds), np.quantile(speeds, 0.1)
        rows.append([GAIT_NAMES[name], f"{median:.1f}", f"{least:.1f}", f"{100 * standing[name]:.0f} %"])
    columns = ["gait", "median, mm/s", "nine in ten reach, mm/s", "do not walk"]
    caption = (
        f"Each gait on {robots} variants of the completed model, every parameter with 2 % relative spread (one "
        "standard deviation)."
    )
    charts: list[Chart] = [walks_chart(list(walks.values())), robustness_chart(summary["robustness"], GAIT_NAMES)]
    return ChartedSection("The gaits", said, [PageTable(columns, rows, caption)], charts)


_ENDING_TEXT = {
    Ending.PREDICTED: "the speed of its gait is predicted to within the scatter of repeats, or to half a per cent",
    Ending.UNCHANGED: "it names the same effects as the previous round; its gait is as fast and predicted no better",
    Ending.FALLS: "with its walks added to the data, the model finds no further gait that it expects to walk",
    Ending.MOST: f"there are at most {ROUNDS} rounds, and the speed of its gait is still not predicted",
}


def rounds_section(rounds: Sequence[Mapping[str, Any]]) -> ChartedSection:
    """How well gaits that were not fitted were predicted, round by round, and why the rounds ended."""
    rows = [
        [
            f"{number}, edge" if one["at_edge"] else str(number),
            f"{one['predicted_mm_s']:.2f} {_interval(one)}",
            f"{one['measured_mm_s']:.2f}{NBSP}±{NBSP}{one['spread_mm_s']:.2f}{'' if one['inside'] else ' (outside)'}",
            plain(one["error_mm"]),
            "" if one["floor_mm"] is None else plain(one["floor_mm"]),
        ]
        for number, one in enumerate(rounds, 1)
    ]
    columns = ["round", "predicted, mm/s", "measured, mm/s", "RMS error, mm", "noise floor, mm"]
    caption = (
        "Each gait as predicted by the model of its round: its speed, its 90 % interval and the probability "
        "of walking, and the positions of head and tail over the walk."
    )
    said = [
        "A model is judged by its prediction of a gait that was not fitted. Round 1 walks the gait found with the "
        "completed model for robots whose parameters differ by 2 %; later gaits are sought for what is known of this "
        "robot, and so are nearer the edge beyond which it does not walk. Between rounds the walks are added to the "
        "data, the model is fitted to all of them, and diagnosed again if that leaves something that matters; the next "
        "round walks the gait of the resulting model.",
        *(
            f"Round {number}: the model includes {' and '.join(map(effect_words, one['effects'])) or 'no effect'}; "
            f"its gait is {gait_words(one['gait'])}."
            for number, one in enumerate(rounds, 1)
        ),
        f"The rounds ended after round {len(rounds)}: {_ENDING_TEXT[rounds[-1]['ended']]}.",
    ]
    return ChartedSection("Gaits that were not fitted", said, [PageTable(columns, rows, caption)])


def gait_name(gait: Mapping[str, Any]) -> str:
    """A gait of summary.json in words, or what was walked in its stead."""
    stand_in = gait.get("stand_in")
    return f"{_STAND_INS[stand_in]}: the {gait['gait']} model has none" if stand_in else WALKED_NAMES[gait["gait"]]


def speed_table(gaits: Sequence[Mapping[str, Any]]) -> PageTable:
    """Table of the predicted and measured speeds of the gaits."""
    rows = [
        [
            gait_name(gait),
            f"{gait['base_model']:.2f}",
            f"{gait['completed_model']:.2f} {_interval(gait)}",
            f"{gait['measured']:.2f}{NBSP}±{NBSP}{gait['spread']:.2f}",
            f"{gait['paper']:.1f}",
        ]
        for gait in gaits
    ]
    columns = ["gait, speed in mm/s", "base model predicts", "completed model predicts", "measured", "in the paper"]
    return PageTable(columns, rows, strong_row=len(rows) - 1)


def _interval(prediction: Mapping[str, Any]) -> str:
    low, high = prediction["interval_90_mm_s"]
    return f"({low:.2f} to {high:.2f}; {prediction['walks_probability']:.2f})"


def prediction_table(errors: Sequence[Mapping[str, Any]], only: str | None = None) -> PageTable:
    """Table of errors before and after, in the instruments' units, with the floor; `only`: "fitted" or "held-out"."""
    rows = []
    for error in errors:
        if only in (None, error["trials"]):
            which = "" if only else f", {error['trials']}"
            rows.append([f"{channel_words(error['quantity'])}{which}", *errors_in_words(error)])
    return PageTable([f"RMS error, {only} trials" if only else "RMS error", *ERROR_COLUMNS], rows)


def errors_in_words(error: Mapping[str, Any]) -> list[str]:
    """Format an error in its instrument's unit, one text for each of `ERROR_COLUMNS`."""
    sides = ("before", "after", "noise_floor")
    return [f"{plain(error[side])}{NBSP}{unit_of(error['quantity'])}" for side in sides]
