"""Charts of walks side by side and of a data set's trials: words, units, and one color per chamber."""

import numpy as np
import pytest
from matplotlib import image

from bifa.data import Trial
from bifa.report.chart import Axis
from bifa.report.datasets import condition_chart
from bifa.report.walks import MEASURED, SIMULATED, Walk, draw_walks, walks_chart
from tests.report.sample import columns


def test_the_figure_is_written_as_png_and_svg(tmp_path):
    walks = [
        Walk("baseline", 5.7, {MEASURED: columns(5.7), "model": columns(5.7)}),
        Walk("optimised", 2.5, {MEASURED: columns(2.5)}),
    ]
    for suffix, magic in ((".png", b"\x89PNG"), (".svg", b"<?xml")):
        path = tmp_path / f"walks{suffix}"
        draw_walks(walks, path)
        assert path.read_bytes().startswith(magic)
        assert path.stat().st_size > 10_000


def test_a_title_with_dollar_signs_is_no_formula(tmp_path):
    draw_walks([Walk(r"$\frac{$", 2.0, {SIMULATED: columns(2.0)})], tmp_path / "walks.png")
    assert (tmp_path / "walks.png").exists()


def test_long_titles_are_wrapped_instead_of_lying_over_the_next_column(tmp_path):
    title = "anchor pull, 8.5 psi, 20 mm/s, load cell 3000 N/m, backward"
    draw_walks([Walk(title, 2.0, {SIMULATED: columns(2.0)})] * 3, tmp_path / "long.png")
    draw_walks([Walk("short", 2.0, {SIMULATED: columns(2.0)})] * 3, tmp_path / "short.png")
    wide, short = (image.imread(tmp_path / name).shape[1] for name in ("long.png", "short.png"))
    assert wide < 1.05 * short


def test_both_gaits_have_the_same_axes_so_that_the_faster_one_looks_faster():
    chart = walks_chart([Walk("a", 5.7, {MEASURED: columns(5.7, 7)}), Walk("b", 2.5, {MEASURED: columns(2.5, 7)})])
    for a, b in zip(chart.columns[0].panels, chart.columns[1].panels, strict=True):
        assert a.x.range == b.x.range
        assert a.y.range == b.y.range
    assert chart.columns[0].panels[0].x.range[1] <= 7 * 2.5
    assert max(s.x.max() for s in chart.columns[0].panels[2].series) <= 7 * 2.5


@pytest.mark.parametrize("speed_mm_s", [-20.0, 0.0, 20.0])
def test_a_path_is_within_its_axis_also_backward_and_as_a_model_predicts_it(speed_mm_s):
    records = {MEASURED: columns(2.0, speed_mm_s=speed_mm_s), "model": columns(2.0, speed_mm_s=1.5 * speed_mm_s)}
    path = walks_chart([Walk("a", 2.0, records)]).columns[0].panels[2]
    low, high = path.y.range
    assert all(low < series.y.min() and series.y.max() < high for series in path.series)


def test_predicted_pressures_are_drawn_too_and_nothing_simulated_is_called_measured():
    chart = walks_chart([Walk("a", 2.0, {MEASURED: columns(2.0), "model": columns(2.0)})])
    pressures = chart.columns[0].panels[1].series
    assert {series.keys for series in pressures} >= {("body", "measured"), ("body", "model")}
    alone = walks_chart([Walk("a", 2.0, {SIMULATED: columns(2.0)})])
    assert "measured" not in {key.label for key in alone.keys}
    assert np.all(np.isfinite(alone.columns[0].panels[2].y.range))


@pytest.mark.parametrize(
    ("reach", "ticks"),
    [
        ((0.7, 30.0), [1.0, 2.0, 5.0, 10.0, 20.0]),
        ((0.68, 1.55), [0.7, 1.0, 1.2, 1.5]),  # a robot without an effect
        ((0.7, 100.0), None),
    ],
)
def test_a_logarithmic_axis_can_be_read_however_short_it_is(reach, ticks):
    assert Axis(range=reach, log=True).log_ticks == (ticks and pytest.approx(ticks))


def test_a_walk_s_chambers_have_their_colors_and_commands_rows_of_their_own():
    gait = {"period_s": 2.0}
    group = [Trial(f"{n}.csv", "locomotion", columns(2.0), gait=gait, repeat=n) for n in (1, 2)]
    chart = condition_chart(group, group[0].label)
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
    chart = condition_chart(group, "static loading")
    assert [key.label for key in chart.keys] == ["run 1", "run 2"]
    assert chart.columns[0].panels[0].x.label == "displacement, mm"
    assert chart.columns[0].panels[0].y.label == "force, N"


def test_pictures_leave_the_users_backend_alone(tmp_path, monkeypatch):
    monkeypatch.setattr("matplotlib.use", lambda *_: pytest.fail("a notebook would show nothing any more"))
    monkeypatch.setattr("matplotlib.pyplot.subplots", lambda *_, **__: pytest.fail("opened a figure of the user's"))
    draw_walks([Walk("a", 2.0, {SIMULATED: columns(2.0)})], tmp_path / "walks.png")
    assert (tmp_path / "walks.png").read_bytes().startswith(b"\x89PNG")
