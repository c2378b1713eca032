"""A search keeps every explanation it tried, and alternative decision rules can be replayed on it."""

import json
from multiprocessing import get_context

import numpy as np
import pytest

import lacuna
from benchmarks import records, replay
from benchmarks.cost import SimulationCount
from benchmarks.replay import bins, brier, predicted
from benchmarks.rules import RULES, within_confidence
from benchmarks.search_record import losses_beside, searched, write_losses
from lacuna import Effect, Parameter, Record


def tried(*effects: str, losses: list[float], cost: float | None = None) -> dict:
    whole = sum(losses) if cost is None else cost
    return {"effects": list(effects), "parameters": len(effects), "cost": whole, "losses": losses, "errors": {}}


def search(*explanations: dict, weights=(), chosen=()) -> dict:
    """A search over four trials of four conditions; the last three are held out for selection."""
    return {
        "trials": ["a", "b", "c", "d"],
        "conditions": ["1", "2", "3", "4"],
        "split": {"fit": ["a"], "select": ["b", "c", "d"], "unseen": [], "final": []},
        "pieces": 100.0,
        "tried": list(explanations),
        "chosen": list(chosen),
        "probability": {},
        "weights": [[list(effects), weight] for effects, weight in weights],
    }


BASE = tried(losses=[100.0, 90.0, 110.0, 95.0])
LEAK = tried("leak", losses=[50.0, 40.0, 52.0, 45.0])


def test_rules_name_what_explains_clearly_and_do_without_what_adds_nothing():
    both = tried("leak", "lag", losses=[49.9, 40.2, 51.9, 44.8])
    found = search(BASE, LEAK, both, weights=[(("leak",), 0.9), (("leak", "lag"), 0.1)], chosen=["leak"])
    for name in ("BIC", "greedy BIC", "largest weight", "smallest within confidence", "the engine's choice"):
        assert list(RULES[name](found)) == ["leak"], name
    assert RULES["least cost"](found) == ["leak", "lag"]


def test_a_pair_that_no_single_begins_is_lost_by_greed_alone():
    pair = tried("leak", "lag", losses=[10.0, 9.0, 11.0, 9.0])
    alone = [tried(name, losses=BASE["losses"]) for name in ("leak", "lag")]
    found = search(BASE, *alone, pair)
    assert RULES["greedy BIC"](found) == []
    assert RULES["BIC"](found) == ["leak", "lag"]
    assert within_confidence(found) == ["leak", "lag"]


def test_confidence_looks_at_what_was_not_fitted_alone():
    fits_only = tried("lag", losses=[1.0, 91.0, 111.0, 96.0])
    assert within_confidence(search(BASE, fits_only)) == []


def a_trial(path):
    leak = {"kind": "single", "seed": 1, "truth": ["leak"], "effects": [{"name": "leak"}]}
    withheld = {"kind": "outside", "seed": 2, "truth": ["creep"], "effects": []}
    found = search(BASE, LEAK, weights=[(("leak",), 0.95), ((), 0.05)], chosen=["leak"])
    records.write(path, [leak, withheld])
    records.write(losses_beside(path), [leak | found, withheld | found])


def test_a_replay_counts_what_each_rule_would_have_named(tmp_path, capsys):
    a_trial(tmp_path / "small.jsonl")
    assert replay.main([str(tmp_path / "small.jsonl"), "--reliability", str(tmp_path / "picture.png")]) == 0
    said = capsys.readouterr().out
    assert "2 sets" in said
    assert "the verdict                   1/1         1/1         0/2 = 0.00" in said
    assert "BIC                           1/1         0/1         1/2 = 0.50" in said
    assert "2 probabilities; Brier" in said
    assert "1 probabilities, without those whose effect is withheld; Brier score 0.0025" in said
    assert (tmp_path / "picture.png").stat().st_size > 1000


def test_a_rule_of_ones_own_is_replayed_beside_them(tmp_path, capsys, monkeypatch):
    a_trial(tmp_path / "small.jsonl")
    (tmp_path / "my_own_rules.py").write_text("def nothing(search):\n    return []\n")
    monkeypatch.chdir(tmp_path)
    replay.main(["small.jsonl", "--rule", "my_own_rules:nothing"])
    assert "my_own_rules:nothing          0/1         1/1" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="module:function"):
        replay.main(["small.jsonl", "--rule", "my_own_rules:absent"])


def test_without_losses_it_says_how_to_get_them(tmp_path):
    records.write(tmp_path / "small.jsonl", [])
    with pytest.raises(SystemExit, match="--records"):
        replay.main([str(tmp_path / "small.jsonl")])


def test_probabilities_that_hold_lie_on_the_line():
    draw = np.random.default_rng(0)
    said = draw.random(20000)
    for one in bins(said, draw.random(20000) < said):
        assert one.there / one.count == pytest.approx(one.mean, abs=0.05)
    assert brier(np.full(4, 0.5), np.array([True, False, True, False])) == 0.25


def test_a_probability_is_that_of_every_explanation_that_holds_the_effect():
    weighed = search(BASE, weights=[(("leak",), 0.6), (("leak", "lag"), 0.3), ((), 0.1)]) | {"truth": ["leak"]}
    probability, there = predicted([weighed])
    assert probability == pytest.approx([0.9, 0.3])
    assert there.tolist() == [True, False]


@pytest.fixture(scope="module")
def diagnosed():
    """Diagnosis of a linear model whose data contain a quadratic term: three runs at each of three slopes."""
    draw, simulations = np.random.default_rng(0), SimulationCount()
    u = np.linspace(-1.0, 1.0, 60)

    def simulate(record, theta):
        x = record["u"]
        return {"y": theta.gain * x + theta.square.size * x**2 + theta.cube.size * x**3}

    def measured(slope, run):
        y = 2.0 * slope * u + 0.5 * (slope * u) ** 2 + 0.02 * draw.standard_normal(60)
        return Record(f"{slope} {run}", "run", slope, np.arange(60.0), {"y": y}, inputs={"u": slope * u})

    effects = [Effect(name, Parameter("size", "1", 0.3, -3.0, 3.0)) for name in ("square", "cube")]
    parameters = [Parameter("gain", "1", 1.5, 0.1, 9.0)]
    system = lacuna.System(simulations.of(simulate), parameters, effects, outputs="y")
    given = [measured(slope, run) for slope in (0.5, 1.0, 2.0) for run in (1, 2, 3)]
    verdict = lacuna.diagnose(system, given, progress=False)
    return verdict, simulations.count


def test_what_the_engine_tried_is_kept_in_plain_types(diagnosed):
    verdict, simulations = diagnosed
    found = searched(verdict.diagnosis, simulations)
    assert json.loads(json.dumps(found)) == found
    assert found["simulations"] == simulations > 20
    assert found["version"]
    assert found["chosen"] == ["square"]
    explanations = {tuple(one["effects"]): one for one in found["tried"]}
    assert {(), ("square",)} <= set(explanations)
    known = {name for part in ("fit", "select", "unseen") for name in found["split"][part]}
    assert set(found["trials"]) == known
    for one in explanations.values():
        assert len(one["losses"]) == len(found["trials"]) == len(found["conditions"])
    assert sum(explanations[("square",)]["losses"]) < 0.5 * sum(explanations[()]["losses"])
    assert all(list(rule(found)) == ["square"] for rule in RULES.values())


def test_a_forked_child_counts_as_well():
    simulations = SimulationCount()
    child = get_context("fork").Process(target=simulations.add, args=(5,))
    child.start()
    child.join()
    simulations.add(2)
    assert simulations.count == 7


def test_what_a_system_simulates_is_counted_a_trial_a_set_of_values():
    class System:
        def predict_trials(self, thetas, effects, trials, **how):
            return list(thetas)

    system, simulations = System(), SimulationCount()
    simulations.of_trials(system)
    assert system.predict_trials([1, 2, 3], (), [None] * 3, coarse=True) == [1, 2, 3]
    assert simulations.count == 3


def test_records_continue_packed_or_not(tmp_path):
    plain, packed = tmp_path / "plain.jsonl", tmp_path / "packed.jsonl.gz"
    for path in (plain, packed):
        assert records.read(path, "seed") == {}
        records.write(path, [{"seed": 1, "x": 0.123456789}])
        assert records.read(path, "seed") == {1: {"seed": 1, "x": 0.123457}}
    assert packed.read_bytes()[:2] == b"\x1f\x8b"


def test_a_blind_trial_adds_what_was_tried_beside_its_records(tmp_path):
    path = tmp_path / "own.jsonl"
    write_losses(path, {"kind": "single", "seed": 1, "truth": ["leak"]})
    assert not losses_beside(path).exists()
    for seed in (1, 2):
        write_losses(path, {"kind": "single", "seed": seed, "truth": ["leak"], "search": search(BASE)})
    found = records.read(losses_beside(path), "kind", "seed")
    assert set(found) == {("single", 1), ("single", 2)}
    assert found["single", 2]["tried"] == [BASE]
