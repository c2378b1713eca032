"""Charts of a diagnosis and a campaign: error before and after, residuals, learnt curves, robustness of gaits."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series, thinned
from bifa.report.words import channel_words, experiment_words

BASE, COMPLETED = "base model", "completed model"
MODEL_KEYS = (Key(BASE, "before"), Key(COMPLETED, "after"))
_ROW_PX = 34
_QUANTITIES = ("force", "displacement", "pressure")
_COLORS = ("quiet", "before", "after")  # one per gait


def errors_chart(error: Mapping[str, Any]) -> Chart:
    """Plot the error before and after, and the noise floor, on a logarithmic axis.

    error: the `error` object of `bifa diagnose --json`, RMS in units of the noise.
    """
    before, after = _bars(error["before"]), _bars(error["after"])
    pairs = {name: (before[name], after[name]) for name in before if name in after}
    return before_and_after(
        pairs,
        error["noise_floor"]["held_out"],
        "Error of the base model and of the completed one by experiment, on a logarithmic axis",
    )


def before_and_after(pairs: Mapping[str, tuple[float, float]], floor: float | None, alt: str) -> Chart:
    """Plot the errors of the base and the completed model, in units of the noise, one row per name. `floor`: the least
    error that held-out trials allow."""
    rows = np.arange(len(pairs), 0, -1, dtype=float)
    links = [
        Series((BASE, COMPLETED), np.array(pair), np.array([row, row]), "quiet")
        for row, pair in zip(rows, pairs.values(), strict=True)
    ]
    before, after = np.array(list(pairs.values())).T
    marks = [Series((BASE,), before, rows, "before", "dots"), Series((COMPLETED,), after, rows, "after", "dots")]
    everything = [value for pair in pairs.values() for value in pair] + [floor or 1.0]
    reach = (0.7 * min(everything), 1.5 * max(everything))
    panel = Panel(
        [*links, *marks],
        Axis("RMS error in units of the noise", reach, log=True),
        Axis(range=(0.4, len(pairs) + 1.0), ticks=dict(zip(pairs, rows.tolist(), strict=True))),
        [("x", floor, "noise floor")] if floor else [],
        len(pairs) * _ROW_PX / 150,
    )
    keys = [Key(BASE, "before", "dots"), Key(COMPLETED, "after", "dots")]
    best = "No model can predict better than runs of the same condition agree:"
    return Chart([Column([panel])], keys, alt, f"{best} {floor:.2f} on held-out trials." if floor else "", across=1)


def learnt_chart(curve: Mapping[str, Any]) -> Chart:
    """Plot a curve learnt where no effect explains the data (an entry of `learnt` of `bifa diagnose --json`)."""
    series, keys = [], []
    for number, (row, values) in enumerate(curve["rows"].items()):
        color = ("ink", "after", "before", "quiet")[number % 4]  # a row is a direction, not a chamber
        x = np.linspace(curve["lower"], curve["upper"], len(values))
        series.append(Series((row or "learnt",), x, np.asarray(values, float), color))
        keys.append(Key(row or "learnt", color))
    added = Axis(f"added, {curve['unit']}" if curve["unit"] else "added")
    panel = Panel(series, Axis(curve["variable"]), added, [("y", 0.0, "")], height=1.2)
    keys = keys if len(keys) > 1 else []
    return Chart([Column([panel])], keys, f"What was learnt: {curve['term']} over {curve['variable']}", across=1)


def _bars(side: Mapping[str, Any]) -> dict[str, float]:
    bars = {"all fitted": side["fitted"], "all held out": side["held_out"]}
    if side.get("held_out_conditions") is not None:
        bars["new conditions"] = side["held_out_conditions"]
    bars |= {experiment_words(name): value for name, value in side.get("by_experiment", {}).items()}
    return {name: value for name, value in bars.items() if value is not None}


# -- residuals ----------------------------------------------------------------------------------------------------


def residual_charts(traces: Sequence[Mapping[str, Any]]) -> dict[str, Chart]:
    """Plot residuals by quantity, one small plot per condition; quantities and conditions in order of decreasing error.

    traces: as in residuals.json: label, channel, time_s, before, after, in units of the noise floor.
    """
    groups = {q: [t for t in traces if t["channel"].startswith(q)] for q in _QUANTITIES}
    groups = {q: sorted(mine, key=_size, reverse=True) for q, mine in groups.items() if mine}
    return {q: _residual_chart(q, groups[q]) for q in sorted(groups, key=lambda q: _size(groups[q][0]), reverse=True)}


def _residual_chart(what: str, traces: Sequence[Mapping[str, Any]]) -> Chart:
    return Chart(
        [_residual_column(trace) for trace in traces],
        MODEL_KEYS,
        f"Measured minus predicted {what} over time in each condition, before and after",
        "Measured minus predicted, in standard deviations of the noise; each plot has its own scale.",
        height=110,
    )


def _residual_column(trace: Mapping[str, Any]) -> Column:
    series = [
        Series((key,), *thinned(trace["time_s"], trace[side], 240), color)
        for key, side, color in ((BASE, "before", "before"), (COMPLETED, "after", "after"))
    ]
    # records of earlier versions have only the trial's file
    label = trace.get("label") or trace["trial"].removesuffix(".csv").replace("_", " ")
    title = f"{label}: {channel_words(trace['channel'])}, {_size(trace):.1f} × noise"
    return Column([Panel(series, Axis("time, s"), Axis("noise sd"))], title)


def _size(trace: Mapping[str, Any]) -> float:
    """RMS residual of the base model."""
    return float(np.sqrt(np.mean(np.square(trace["before"]))))


# -- robustness ---------------------------------------------------------------------------------------------------


def robustness_chart(speeds: Mapping[str, Sequence[float]], titles: Mapping[str, str]) -> Chart:
    """Plot the share of robots on which each gait is no faster than a speed. `speeds`: by gait, in mm/s, sorted."""
    series, keys = [], []
    for (name, values), color in zip(speeds.items(), _COLORS, strict=False):
        share = 100.0 * np.arange(1, len(values) + 1) / len(values)
        label = titles.get(name, name)
        x, y = np.concatenate(([0.0], values)), np.concatenate(([0.0], share))
        series.append(Series((label,), x, y, color, "steps"))
        keys.append(Key(label, color))
    fastest = max(values[-1] for values in speeds.values())
    panel = Panel(
        series,
        Axis("settled speed, mm/s", (0.0, 1.05 * fastest)),
        Axis("% of robots no faster", (0.0, 103.0)),
        [("y", 10.0, "one robot in ten")],
        1.4,
    )
    return Chart([Column([panel])], keys, "Speed of each gait on robots that differ slightly from this one", across=1)
