"""Gaits near the cliff, and the calibration of their predicted probability of walking."""

from dataclasses import replace

import pytest

from benchmarks import cliff
from benchmarks.cliff import Step
from bifa.gait import library
from bifa.robot import BASELINE, nominal


def test_gaits_are_found_with_which_nearly_all_to_few_of_the_robots_walk():
    robust = library.load("robust").gait
    found = cliff.at_the_cliff(nominal(), replace(robust, period_s=1.05 * robust.period_s))
    probabilities = [prediction.walks_probability for _, prediction in found]
    assert probabilities == pytest.approx(cliff.WANTED, abs=0.06)  # a step function: the robots are finitely many
    assert sorted(faster for faster, _ in found) == [faster for faster, _ in found]
    assert cliff.at_the_cliff(nominal(), BASELINE) == [], "the baseline gait has no cliff"


def test_what_was_predicted_is_compared_with_what_walked(capsys):
    speeds = [(20.5, 20.5)] * 3 + [(20.5, 0.5), (22.0, 0.5)]
    steps = [
        Step(0.002, probability, (20.0, 21.0), runs, tuple(speed >= 16.0 for speed in runs))
        for probability, runs in zip(cliff.WANTED, speeds, strict=True)
    ]
    figures = cliff.summed_up([steps, []])
    assert figures["cliff_robots"] == 1
    squares = [0.05**2] * 2 + [0.2**2] * 2 + [0.5**2] * 2 + [0.8**2, 0.2**2] + [0.95**2, 0.05**2]
    assert figures["cliff_brier"] == pytest.approx(sum(squares) / 10)
    assert figures["cliff_holds_90"] == pytest.approx(7 / 8)
    assert "1 of 2" in cliff.row("leak-3", steps)
    assert cliff.row("leak-3", []).endswith("no cliff")
    assert "0.50" in capsys.readouterr().out
