"""Regret of gait searches against the best known gait: the table, and peer optimizers on the same budget."""

from unittest.mock import Mock

import pytest

from benchmarks import regret
from bifa.gait import Settings, simulations
from bifa.robot import nominal

RECORD = {
    "robot": "nominal",
    "nominal": [23.0, 22.0],
    "nominal_s": 3.0,
    "nominal_long": [23.1],
    "robust": [21.0, 21.0],
    "robust_s": 5.0,
    "robust_long": [20.0],
    "evaluations": 1500,
    "de": 23.2,
    "direct": 11.0,
    "shgo": 12.0,
}


def test_regret_is_against_the_best_of_all_runs_and_peers():
    found = regret.regrets(RECORD)
    assert found == pytest.approx([1.0 - 23.0 / 23.2, 1.0 - 22.0 / 23.2, 0.0, 0.0])
    row, heading = regret.row("nominal", RECORD), regret.HEADING.splitlines()
    assert [len(row)] * 2 == [len(line) for line in heading]
    assert row.split()[-5:] == ["1500", "23.20", "11.00", "12.00", f"{100 * max(found):.2f}"]


def test_a_robot_that_was_not_searched_fully_counts_with_its_nominal_searches():
    record = {key: RECORD[key] for key in ("robot", "nominal", "nominal_s", "nominal_long", "evaluations")}
    assert regret.regrets(record) == pytest.approx([1.0 - 23.0 / 23.1, 1.0 - 22.0 / 23.1])
    assert len(regret.row("nominal", record)) == len(regret.row("nominal", RECORD))


def test_what_a_record_has_is_not_searched_again(monkeypatch):
    lacking = {key: value for key, value in RECORD.items() if key != "shgo"}
    monkeypatch.setattr(regret, "peer", judge := Mock(return_value=14.0))
    assert regret.searched(lacking, nominal(), Settings(), range(2), 1, None) == RECORD | {"shgo": 14.0}
    judge.assert_called_once()
    assert "shgo" not in lacking


@pytest.mark.parametrize("name", ["direct", "shgo"])
def test_a_peer_has_no_more_than_its_budget_and_is_judged_by_the_finer_metric(name):
    spent = []

    def counted(speed, box, budget):
        def one(point):
            spent.append(speed(point))
            return spent[-1]

        return regret.PEERS[name](one, box, budget)

    with simulations() as runs:
        found = regret.peer(counted, nominal(), Settings(), 200, runs)
    assert 100 <= len(spent) <= 200
    assert 0.0 <= found <= 1.02 * -min(spent)
