"""Small multiples of residuals: where they live, before and after an effect was added."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bifa.report.chart import Axis, Chart, Column, Panel, Series, thinned
from bifa.report.evidence import BASE, COMPLETED, MODEL_KEYS
from bifa.report.words import channel_words

_QUANTITIES = ("force", "displacement", "pressure")


def residual_charts(traces: Sequence[Mapping[str, Any]]) -> dict[str, Chart]:
    """By quantity, the one that the base model misses most first: a small plot a condition, the worst first.

    traces: as in residuals.json: label, channel, time_s, before, after, in units of the noise floor.
    """
    groups = {q: [t for t in traces if t["channel"].startswith(q)] for q in _QUANTITIES}
    groups = {q: sorted(mine, key=_size, reverse=True) for q, mine in groups.items() if mine}
    return {q: _chart(q, groups[q]) for q in sorted(groups, key=lambda q: _size(groups[q][0]), reverse=True)}


def _chart(what: str, traces: Sequence[Mapping[str, Any]]) -> Chart:
    return Chart(
        [_column(trace) for trace in traces],
        MODEL_KEYS,
        f"Measured minus predicted {what} over time in each condition, before and after",
        "Measured minus predicted, in standard deviations of the noise; each plot has its own scale.",
        height=110,
    )


def _column(trace: Mapping[str, Any]) -> Column:
    series = [
        Series((key,), *thinned(trace["time_s"], trace[side], 240), color)
        for key, side, color in ((BASE, "before", "before"), (COMPLETED, "after", "after"))
    ]
    title = f"{_label(trace)}: {channel_words(trace['channel'])}, {_size(trace):.1f} × noise"
    return Column([Panel(series, Axis("time, s"), Axis("noise sd"))], title)


def _label(trace: Mapping[str, Any]) -> str:
    """What the trial is called; records of earlier versions have only its file."""
    return trace.get("label") or trace["trial"].removesuffix(".csv").replace("_", " ")


def _size(trace: Mapping[str, Any]) -> float:
    """RMS of what the base model leaves."""
    return float(np.sqrt(np.mean(np.square(trace["before"]))))
