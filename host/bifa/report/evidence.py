"""Charts of a diagnosis: error before and after per experiment, and what was learnt."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series
from bifa.report.words import experiment_words

BASE, COMPLETED = "base model", "completed model"
MODEL_KEYS = (Key(BASE, "before"), Key(COMPLETED, "after"))
_ROW_PX = 34


def errors_chart(error: Mapping[str, Any]) -> Chart:
    """Before against after, against the floor, on a logarithmic axis.

    error: the `error` object of `bifa diagnose --json` (contracts, section 5), RMS in units of the noise.
    """
    before, after = _bars(error["before"]), _bars(error["after"])
    pairs = {name: (before[name], after[name]) for name in before if name in after}
    return before_and_after(
        pairs,
        error["noise_floor"]["held_out"],
        "Error of the base model and of the completed one by experiment, on a logarithmic axis",
    )


def before_and_after(pairs: Mapping[str, tuple[float, float]], floor: float | None, alt: str) -> Chart:
    """A row a name: the error of the base model and of the completed one, in units of the noise; `floor`: the least
    that held-out trials allow."""
    names = list(pairs)
    before, after = ({name: pair[side] for name, pair in pairs.items()} for side in (0, 1))
    rows = np.arange(len(names), 0, -1, dtype=float)
    links = [
        Series((BASE, COMPLETED), np.array([before[name], after[name]]), np.array([row, row]), "quiet")
        for row, name in zip(rows, names, strict=True)
    ]
    marks = [
        Series((BASE,), np.array([before[name] for name in names]), rows, "before", "dots"),
        Series((COMPLETED,), np.array([after[name] for name in names]), rows, "after", "dots"),
    ]
    everything = [*(before[n] for n in names), *(after[n] for n in names), floor or 1.0]
    reach = (0.7 * min(everything), 1.5 * max(everything))
    panel = Panel(
        [*links, *marks],
        Axis("RMS error in units of the noise", reach, log=True),
        Axis(range=(0.4, len(names) + 1.0), ticks=dict(zip(names, rows.tolist(), strict=True))),
        [("x", floor, "noise floor")] if floor else [],
        len(names) * _ROW_PX / 150,
    )
    keys = [Key(BASE, "before", "dots"), Key(COMPLETED, "after", "dots")]
    return Chart(
        [Column([panel])],
        keys,
        alt,
        f"No model predicts better than runs of the same condition agree: to {floor:.2f} on held-out trials."
        if floor
        else "",
        across=1,
    )


def learnt_chart(curve: Mapping[str, Any]) -> Chart:
    """A curve learnt where no effect explains the data (an entry of `learnt` of `bifa diagnose --json`)."""
    # Neither of the chambers' colours nor of the models': a row is a direction.
    colors = ("ink", "after", "before", "quiet")
    rows = {row or "learnt": np.asarray(values, float) for row, values in curve["rows"].items()}
    series = [
        Series((row,), np.linspace(curve["lower"], curve["upper"], len(values)), values, colors[i % 4])
        for i, (row, values) in enumerate(rows.items())
    ]
    unit = curve["unit"]
    panel = Panel(
        series, Axis(curve["variable"]), Axis(f"added, {unit}" if unit else "added"), [("y", 0.0, "")], height=1.2
    )
    keys = [Key(row, colors[i % 4]) for i, row in enumerate(rows)] if len(rows) > 1 else []
    return Chart([Column([panel])], keys, f"What was learnt: {curve['term']} over {curve['variable']}", across=1)


def _bars(side: Mapping[str, Any]) -> dict[str, float]:
    bars = {"all fitted": side["fitted"], "all held out": side["held_out"]}
    if side.get("held_out_conditions") is not None:
        bars["new conditions"] = side["held_out_conditions"]
    bars |= {experiment_words(name): value for name, value in side.get("by_experiment", {}).items()}
    return {name: value for name, value in bars.items() if value is not None}
