"""The optimiser's figures: sensitivity, speed against robustness, distribution. All speeds are settled speeds."""

from collections.abc import Mapping, Sequence

import numpy as np

from bifa.gait.objectives import QUANTILE
from bifa.gait.search import Optimum
from bifa.gait.sensitivity import Front, Scan
from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series

_BINS = 60


def sensitivity_chart(scans: Sequence[Scan]) -> Chart:
    """Plot the speed over each gait parameter; shaded: the range in which nine robots in ten keep 90 % of the speed."""
    keys = [Key("the model itself", "measured"), Key("10th percentile", "after"), Key("room", "grid", "area")]
    most = 1.05 * max(float(np.max(scan.nominal_mm_s)) for scan in scans)
    columns = []
    for scan in scans:
        series = [
            Series(("room",), np.array(scan.room), np.full(2, most), "grid", "area"),
            Series(("the model itself",), scan.values, scan.nominal_mm_s, "measured"),
            Series(("10th percentile",), scan.values, scan.quantile_mm_s, "after"),
        ]
        across = Axis(f"{scan.name}, room {scan.room[0]:.4g} to {scan.room[1]:.4g} {scan.unit}".rstrip())
        columns.append(Column([Panel(series, across, Axis("speed, mm/s", (0.0, most)), [("x", scan.at, "")])]))
    return Chart(columns, keys, "Speed over each parameter of the gait, the others unchanged", height=200)


def front_chart(found: Front, chosen_mm_s: tuple[float, float]) -> Chart:
    """Plot the speed that nine robots in ten reach against the speed on the model."""
    best = found.efficient & (found.nominal_mm_s > 0)
    order = np.argsort(found.nominal_mm_s[best])
    x, y = found.nominal_mm_s[best][order], found.quantile_mm_s[best][order]
    keys = [Key("gaits tried", "before", "dots"), Key("front", "after"), Key("the gait chosen", "ink", "dots")]
    series = [
        Series(("gaits tried",), found.nominal_mm_s, found.quantile_mm_s, "before", "dots"),
        Series(("front",), x, y, "after"),
        Series(("the gait chosen",), np.array(chosen_mm_s[:1]), np.array(chosen_mm_s[1:]), "ink", "dots"),
    ]
    panel = Panel(series, Axis("speed on the model itself, mm/s"), Axis("10th percentile of robots, mm/s"))
    return Chart([Column([panel])], keys, "Speed against robustness of gaits", height=350)


def distribution_chart(optimum: Optimum, others: Mapping[str, np.ndarray]) -> Chart:
    """Plot the speeds on robots that the search has not seen; `others`: speeds of other gaits on the same robots."""
    shown = {"this gait": optimum.speeds_mm_s, **others}
    top = max(1.0, *(speeds.max() for speeds in shown.values()))
    bins = np.linspace(0.0, 1.05 * top, _BINS)
    series: list[Series] = []
    keys = []
    for (name, speeds), color in zip(shown.items(), ("after", "quiet", "before"), strict=False):
        label = f"{name}: 10th percentile {np.quantile(speeds, QUANTILE):.1f} mm/s"
        style = "steps" if series else "area"
        series.append(Series((label,), bins, np.append(np.histogram(speeds, bins)[0], 0), color, style))
        keys.append(Key(label, color, style))
    panel = Panel(
        series,
        Axis(f"settled speed, mm/s, {optimum.spread.text}"),
        Axis(f"robots of {optimum.speeds_mm_s.size}"),
        [("x", optimum.percentile_10_mm_s, "")],
    )
    return Chart([Column([panel])], keys, "Speeds of gaits on robots that differ from the model", height=350)
