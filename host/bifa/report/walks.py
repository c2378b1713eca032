"""Walks side by side, like the paper's Fig. 7: CPG outputs, pressures, displacement."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bifa.ranges import CHAMBERS
from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series, edges, thinned
from bifa.report.evidence import BASE, COMPLETED
from bifa.report.picture import draw_chart

MEASURED, SIMULATED = "measured", "simulated"
_ROLES = {BASE: "before", COMPLETED: "after"}  # everything else is drawn in ink
_ROW, _BAR = 1.2, 0.9
_LINES = ("line", "dashed", "dotted")
_MARGIN = 0.05  # share of the path's range that its axis leaves at either end


@dataclass(frozen=True)
class Walk:
    """One gait. `records`: what is drawn, by label (`MEASURED`, `SIMULATED`, a model's name), the first as solid lines;
    each has the columns of a locomotion trial, arrays of shape (n,)."""

    title: str
    period_s: float
    records: Mapping[str, Mapping[str, np.ndarray]]


def walks_chart(walks: Sequence[Walk]) -> Chart:
    """Plot all walks over equal times (that of the shortest record) and distances, so that faster ones look faster."""
    horizon_s = min(float(next(iter(walk.records.values()))["time_s"][-1]) for walk in walks)
    records = [record for walk in walks for record in walk.records.values()]
    paths = np.concatenate([[0.0], *(_truncate(r, "displacement_head_mm", horizon_s)[1] for r in records)])
    margin = _MARGIN * max(float(np.ptp(paths)), 1.0)
    reach = (float(paths.min()) - margin, float(paths.max()) + margin)
    names = list(dict.fromkeys(name for walk in walks for name in walk.records))
    keys = [Key(chamber, chamber, "area") for chamber in CHAMBERS]
    lines = dict(zip(names, _LINES, strict=False))
    keys += [Key(name, _ROLES.get(name, "ink"), lines[name]) for name in names]
    pressures = [r[f"pressure_{chamber}_psi"] for r in records for chamber in CHAMBERS]
    span = (min(float(np.min(p)) for p in pressures) - 1.0, max(float(np.max(p)) for p in pressures) + 1.0)
    return Chart(
        [_column(walk, horizon_s, reach, span, lines) for walk in walks],
        keys,
        "CPG outputs, pressures and displacement of the gaits side by side",
        height=120,
    )


def draw_walks(walks: Sequence[Walk], path: Path) -> None:
    """Write the figure to `path` (PNG or SVG)."""
    draw_chart(walks_chart(walks), path, width_in=max(6.4, 4.4 * min(len(walks), 3)))


def _column(
    walk: Walk, horizon_s: float, reach: tuple[float, float], span: tuple[float, float], lines: Mapping[str, str]
) -> Column:
    """Plot one walk. `reach`: range of the path's axis, mm; `span`: range of the pressures' axis, psi; `lines`: line
    style of each record."""
    time = Axis("time, s", (0.0, horizon_s))
    first = next(iter(walk.records))
    outputs = [
        Series((chamber, first), x, row * _ROW + _BAR * np.nan_to_num(y), chamber, "area", base=row * _ROW)
        for row, chamber in enumerate(CHAMBERS)
        for x, y in [edges(*_truncate(walk.records[first], f"command_{chamber}", horizon_s))]
    ]
    pressures, paths = [], []
    for name, record in walk.records.items():
        x, y = thinned(*_truncate(record, "displacement_head_mm", horizon_s))
        paths.append(Series((name,), x, y, _ROLES.get(name, "ink"), lines[name]))
        for chamber in CHAMBERS:
            x, y = thinned(*_truncate(record, f"pressure_{chamber}_psi", horizon_s))
            pressures.append(Series((chamber, name), x, y, chamber, lines[name]))
    rows = {chamber: row * _ROW + 0.5 * _BAR for row, chamber in enumerate(CHAMBERS)}
    panels = [
        Panel(outputs, time, Axis("output", (-0.2, 3 * _ROW), ticks=rows), height=0.7),
        Panel(pressures, time, Axis("pressure, psi", span)),
        Panel(paths, time, Axis("head, mm", reach), height=1.4),
    ]
    return Column(panels, walk.title)


def _truncate(record: Mapping[str, np.ndarray], column: str, horizon_s: float) -> tuple[np.ndarray, np.ndarray]:
    shown = record["time_s"] <= horizon_s
    return record["time_s"][shown], np.asarray(record[column])[shown]
