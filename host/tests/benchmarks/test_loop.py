"""The benefit of the closed loop: table, coverage and records of the benchmark."""

from dataclasses import replace
from unittest.mock import Mock

import pytest

from benchmarks import loop
from benchmarks.loop import Gain, Walked


def gait(speed, runs=None, probability=0.97, half=0.2):
    intervals = {str(level): (speed - half * level, speed + half * level) for level in (0.8, 0.9, 0.95)}
    return Walked(speed, intervals, probability, tuple(runs or (speed, speed, speed)))


def robot(effect="leak", seed=3, named=("leak",), **gaits):
    speeds = {"baseline": 10.8, "naive": 23.0, "fair": 21.0, "robust": 22.0, "edge": 23.0}
    return Gain(effect, seed, named, {name: gait(v) for name, v in speeds.items()} | gaits)


@pytest.mark.parametrize(
    ("named", "said"), [(("leak",), "yes"), (("leak", "stribeck"), "and others"), (("stribeck",), "no"), ((), "no")]
)
def test_a_row_says_whether_the_effect_was_named(named, said):
    text = loop.row(robot(named=named))
    assert text.split("  ")[0] == "leak, 3"
    assert text[24:36].strip() == said
    assert len(text) == len(loop.HEADING)


def test_a_row_shows_interval_speed_and_where_runs_fell():
    text = loop.row(robot(naive=gait(23.0, (23.0, 1.0, 23.0))))
    assert "22.82..23.18 15.67*" in text
    assert "22.82..23.18 23.00" in text
    one = robot()
    del one.gaits["edge"]
    assert loop.row(one).endswith("none")


def test_runs_that_fall_count_for_the_probability_and_not_for_the_coverage():
    one = gait(23.0, (23.0, 23.185, 1.0), probability=0.9)
    assert one.walks == (True, True, False)
    assert one.holds(0.9) == [True, False]
    assert one.holds(0.95) == [True, True]


def test_means_over_robots(capsys):
    gains = [robot(), robot(seed=4, naive=gait(23.0, (1.0, 1.0, 1.0)), edge=gait(24.2, (24.2, 24.2, 24.2)))]
    figures = loop.summed_up(gains)
    assert figures["loop_edge_mm_s"] == pytest.approx(23.6)
    assert figures["loop_edge_gain"] == pytest.approx(23.6 / 22.0 - 1.0)
    assert figures["loop_naive_walks"] == pytest.approx(0.5)
    assert figures["loop_naive_brier"] == pytest.approx(0.5 * (0.03**2 + 0.97**2))
    assert figures["loop_edge_holds_90"] == 1.0
    assert figures["loop_edge_worst_ahead_of_base"] == pytest.approx(0.0)
    assert "robots: 2" in capsys.readouterr().out


def test_the_edge_is_compared_with_the_better_of_the_base_models_gaits_on_every_robot():
    still = gait(23.0, (0.0, 0.0, 0.0))
    gains = [robot(edge=gait(23.46)), robot(edge=gait(21.42), naive=gait(20.0)), robot(naive=still, fair=still)]
    assert loop.summed_up(gains)["loop_edge_worst_ahead_of_base"] == pytest.approx(0.02)
    assert loop.summed_up([robot(edge=gait(22.77))])["loop_edge_worst_ahead_of_base"] == pytest.approx(-0.01)


def test_coverage_over_first_gaits_is_shown_beside_that_of_the_gaits_handed_over(capsys):
    gains = [replace(robot(), edge_inside=inside) for inside in ((True,), (False, True), ())]
    figures = loop.summed_up(gains)
    assert figures["loop_first_edge_holds_90"] == pytest.approx(1 / 2)
    assert figures["loop_every_edge_holds_90"] == pytest.approx(2 / 3)
    assert "1 of 2 first gaits at the edge, 2 of 3" in capsys.readouterr().out
    assert "loop_first_edge_holds_90" not in loop.summed_up([robot()])  # of a record that lacks it


def test_reliability_compares_what_was_predicted_with_what_walked_and_is_drawn(tmp_path):
    found = loop.reliability([robot(naive=gait(23.0, (23.0, 1.0, 1.0), probability=0.6))])
    assert found == [(pytest.approx(0.6), pytest.approx(1 / 3), 3), (pytest.approx(0.97), 1.0, 12)]
    loop.plot([robot()], tmp_path / "reliability.png")
    assert (tmp_path / "reliability.png").stat().st_size > 5000


def test_an_interrupted_run_sums_up_what_there_is(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(loop, "measured", Mock(side_effect=[robot(), KeyboardInterrupt]))
    figures = loop.run(("leak", "stribeck"), range(2), tmp_path)
    assert figures["loop_edge_mm_s"] == 23.0
    assert "interrupted after 1 of 4 robots" in capsys.readouterr().out


def test_a_run_goes_on_from_its_records(monkeypatch, tmp_path):
    kept, measured = tmp_path / "loop.jsonl", Mock(side_effect=lambda effect, seed, out: robot(effect, seed))
    monkeypatch.setattr(loop, "measured", measured)
    first = loop.run(("leak",), range(2), tmp_path, kept)
    assert loop.run(("leak",), range(2), tmp_path, kept) == first
    loop.run(("leak", "stribeck"), range(1), tmp_path, kept)
    assert [call.args[:2] for call in measured.call_args_list] == [("leak", 0), ("leak", 1), ("stribeck", 0)]
    assert len(kept.read_text().splitlines()) == 3
