"""How fast gaits are on robots that differ a little from the one they were made for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series

STANDING_MM_S = 0.5  # a robot that is slower slips in place
_COLORS = ("quiet", "before", "after")


def standing_share(speeds: Sequence[float]) -> float:
    """The share of robots that do not walk, 0 to 1."""
    return float(np.mean(np.asarray(speeds) < STANDING_MM_S))


def robustness_chart(speeds: Mapping[str, Sequence[float]], titles: Mapping[str, str]) -> Chart:
    """The share of robots on which each gait is slower than a speed. `speeds`: by gait, mm/s, sorted."""
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
