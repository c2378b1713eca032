"""Regret of gait searches against the best known gait: the table, and peer optimizers on the same budget."""

from dataclasses import replace
from unittest.mock import Mock

import pytest

from benchmarks import regret
from bifa.gait import Settings, optimize, simulations
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
FOUND = Mock(nominal_mm_s=20.0, quantile_mm_s=20.0, evaluations=100)


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


def test_robust_gaits_are_judged_on_the_same_robots_whatever_the_search():
    """A search reported 21.16 mm/s of a gait whose percentile on 8,192 robots is 21.72."""
    with simulations() as runs:
        first, second = (optimize(nominal(), runs, Settings(evaluations=24, seed=seed)) for seed in (0, 1))
        judged = [regret.judged(replace(one, gait=first.gait), nominal(), runs) for one in (first, second)]
    assert judged[0] == judged[1] > 15.0
    assert judged[0] == pytest.approx(first.quantile_mm_s, rel=0.05)


def test_only_seeds_that_a_record_lacks_are_searched(monkeypatch):
    monkeypatch.setattr(regret, "judged", lambda *_: 20.0)
    monkeypatch.setattr(regret, "optimize", search := Mock(return_value=FOUND))
    record = regret.searched(RECORD, nominal(), Settings(), range(3), 1, None)
    asked = [call.args[2] for call in search.call_args_list]
    assert [(settings.robust, settings.seed) for settings in asked] == [(False, 2), (True, 2)]
    assert (record["nominal"], record["robust"]) == ([23.0, 22.0, 20.0], [21.0, 21.0, 20.0])
    assert 0.0 < record["robust_s"] < 5.0


def test_an_earlier_search_tells_of_the_best_known_gait_only(monkeypatch):
    monkeypatch.setattr(regret, "judged", lambda *_: 20.0)
    monkeypatch.setattr(regret, "optimize", Mock(return_value=FOUND))
    begun = regret.known_before(RECORD)
    assert regret.regrets(begun) == []
    record = regret.searched(begun, nominal(), Settings(), range(1), 1, None)
    assert (record["nominal_long"], record["evaluations"], record["de"]) == ([23.0, 22.0, 23.1], 1500, 23.2)
    assert regret.regrets(record) == pytest.approx([1.0 - 20.0 / 23.2, 1.0 - 20.0 / 21.0])


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
