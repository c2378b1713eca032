"""Pictures of a data set: words, units, and one colour for one chamber."""

import numpy as np

from bifa.data import Trial
from bifa.report.datasets import condition_chart
from tests.report.sample import columns


def test_a_walk_s_chambers_have_their_colors_and_commands_rows_of_their_own():
    gait = {"period_s": 2.0}
    group = [Trial(f"{n}.csv", "locomotion", columns(2.0), gait=gait, repeat=n) for n in (1, 2)]
    chart = condition_chart(group)
    assert chart.title == "walk, period 2 s (2 runs)"
    assert {key.label: key.color for key in chart.keys} == {"body": "body", "head": "head", "tail": "tail"}
    (column,) = chart.columns
    assert [panel.y.label for panel in column.panels] == ["displacement, mm", "command", "pressure, psi"]
    commands = column.panels[1]
    assert list(commands.y.ticks) == ["body", "head", "tail"]
    assert len({float(series.y.min()) for series in commands.series}) == 3


def test_repeats_of_a_test_stand_are_told_apart():
    record = {"time_s": np.arange(3.0), "displacement_mm": np.arange(3.0), "force_N": np.arange(3.0)}
    group = [Trial(f"{n}.csv", "static_loading", record, actuator="large", repeat=n) for n in (1, 2)]
    chart = condition_chart(group)
    assert [key.label for key in chart.keys] == ["run 1", "run 2"]
    assert chart.columns[0].panels[0].x.label == "displacement, mm"
    assert chart.columns[0].panels[0].y.label == "force, N"
