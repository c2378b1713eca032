"""The comparison with common alternatives: each rival works correctly, and all are judged on held-out records."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from benchmarks import bench_systems
from benchmarks.systems import bouc_wen, emps, spring, tanks
from benchmarks.systems.lines import lines_of
from benchmarks.systems.problem import KnownProblem, RivalAnswer
from benchmarks.systems.rivals import best_subset, engine, gaussian_process, sparse_regression
from benchmarks.systems.table import judged
from lacuna import Effect, Parameter, Record

pytestmark = pytest.mark.slow

EFFECTS = (
    Effect("square", Parameter("size", "1", 1.0, -5.0, 5.0)),
    Effect("offset", Parameter("size", "1", 1.0, -5.0, 5.0)),
    Effect("limit", Parameter("level", "1", 1.4, 0.5, np.inf), absent=np.inf),
    Effect("cube", Parameter("size", "1", 1.0, 0.0, 5.0)),
)


def static(hidden, noise=0.0, seed=0):
    """The problem y = gain u plus the terms in `hidden`: so simple that every fit is exact."""

    def simulate(record, theta):
        u = record["u"]
        found = theta.gain * u + theta.square.size * u**2 + theta.offset.size + theta.cube.size * u**3
        return {"y": np.clip(found, -theta.limit.level, theta.limit.level)}

    def record(name):
        u = draw.uniform(-1.0, 1.0, 200)
        one = Record(name, "run", name, np.arange(200.0), {"y": np.zeros(200)}, inputs={"u": u})
        clean = empty.predict(one, {"gain": 2.0, **hidden})
        return replace(one, channels={"y": clean + noise * draw.standard_normal(200)})

    draw = np.random.default_rng(seed)
    truth = frozenset(name.split(".")[0] for name in hidden)
    gain = (Parameter("gain", "1", 1.0, 0.1, 10.0),)
    empty = KnownProblem("static", "static", "", "y", simulate, gain, EFFECTS, truth, (), (), 0)
    return replace(empty, fitted=(record("a"), record("b")), held_out=(record("c"),))


@pytest.mark.parametrize(
    "hidden",
    [{}, {"cube.size": 0.7}, {"limit.level": 1.2}, {"square.size": -0.4, "offset.size": 0.3}],
    ids=["nothing", "one", "a limit", "two"],
)
def test_best_subset_finds_what_is_there_and_its_size(hidden):
    problem = static(hidden, noise=1e-3)
    answer = best_subset.solve(problem)
    assert set(answer.named) == problem.truth
    found = best_subset.fit(problem, answer.named)
    assert found == pytest.approx({"gain": 2.0, **hidden}, rel=0.01)
    assert problem.error_percent(answer.predict) < 0.2


def test_bic_is_the_textbooks():
    problem = static({}, noise=0.1)
    rss = np.sum(problem.residual({"gain": 2.0}, problem.fitted) ** 2)
    assert best_subset.bic(problem, {"gain": 2.0}) == pytest.approx(400 * np.log(rss / 400) + np.log(400))


def test_fits_keep_to_the_bounds():
    """A cubic term that fits best with a negative size, outside its bounds, stays at 0."""
    problem = static({})
    negated = (replace(r, channels={"y": 2.0 * r["u"] - 0.7 * r["u"] ** 3}) for r in problem.fitted)
    assert best_subset.fit(replace(problem, fitted=tuple(negated)), ["cube"])["cube.size"] >= 0.0


def test_an_effect_that_is_off_stands_where_it_is_absent():
    problem = static({})
    theta = problem.theta(problem.fitted[0], {"cube.size": 2.0})
    assert (theta.limit.level, theta.offset.size, theta.cube.size) == (np.inf, 0.0, 2.0)


def test_sparse_regression_recovers_terms_and_parameters_where_there_is_no_noise():
    quiet = spring.problem(hidden={"cubic_spring.stiffness_N_m3": 4000.0})
    still = {**spring.BASE, "cubic_spring.stiffness_N_m3": 4000.0}
    sweeps = [r for r in quiet.fitted if r.experiment == "sweep"]  # a derivative filter blurs the response to a step
    clean = tuple(replace(r, channels={"position_mm": quiet.predict(r, still)}) for r in sweeps)
    quiet = replace(quiet, fitted=clean, held_out=clean)
    answer = sparse_regression.solve(quiet)
    assert answer.named == ("cubic_spring",)
    assert quiet.error_percent(answer.predict) < 1.0
    found = next(f for f in sparse_regression.path(quiet, quiet.terms, 9) if len(f) == 4)
    assert found == pytest.approx(still, rel=0.01)


def test_sparse_regression_offers_no_parameter_outside_its_bounds():
    problem = spring.problem()
    bounds = dict(problem.free(problem.library))
    found = sparse_regression.path(problem, problem.terms, 21)
    assert found
    assert all(bounds[name].lower <= value <= bounds[name].upper for f in found for name, value in f.items())


def test_a_gaussian_process_learns_what_is_left_and_predicts_from_inputs_alone():
    problem = static({"square.size": 1.0, "offset.size": 0.5}, noise=0.01)
    base = best_subset.fit(problem)
    answer = gaussian_process.solve(problem)
    assert answer.named is None
    as_it_is = problem.error_percent(lambda record: problem.predict(record, base))
    assert problem.error_percent(answer.predict) < 0.1 * as_it_is
    blind = replace(problem.held_out[0], channels={"y": np.full(200, np.nan)})
    np.testing.assert_array_equal(answer.predict(blind), answer.predict(problem.held_out[0]))


def test_the_error_is_of_records_that_nobody_fits_relative_to_their_spread():
    problem = static({})
    spread = np.std(problem.held_out[0].channels["y"])
    off = problem.error_percent(lambda record: problem.predict(record, {"gain": 2.0}) + 0.25)
    assert off == pytest.approx(100 * 0.25 / spread)
    assert {r.name for r in problem.fitted}.isdisjoint(r.name for r in problem.held_out)


CUBE = static({"cube.size": 0.7})
NOTHING = replace(static({}), expected="none")


@pytest.mark.parametrize(
    ("problem", "named", "verdict", "right"),
    [
        (CUBE, ("cube",), "", "yes"),
        (CUBE, ("cube",), "identified", "yes"),
        (CUBE, ("cube", "offset"), "", "no"),
        (CUBE, (), "unexplained", "no"),
        (CUBE, None, "", "-"),
        (NOTHING, (), "none", "yes"),
        (NOTHING, (), "unexplained", "no"),
    ],
)
def test_right_is_neither_more_nor_less_than_what_is_there(problem, named, verdict, right):
    assert judged(problem, RivalAnswer(named, np.zeros, verdict))[0] == right


def test_lines_are_those_of_code(tmp_path, monkeypatch):
    head = '"""Of the file."""\nimport os\n\nA = (\n    1,\n)  # one\n\n\n'
    body = 'def f(x):\n    """What.\n\n    More.\n    """\n    # a comment\n    return (\n        x\n    )\n\n\n'
    source = head + body + "B, C = 1, 2\n"
    (tmp_path / "counted.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    counted: ModuleType = __import__("counted")
    assert lines_of(counted, ["A"]) == 3
    assert lines_of(counted, ["f"]) == 4
    assert lines_of(counted, ["C"]) == 1
    assert lines_of(counted) == 3 + 4 + 1
    with pytest.raises(ValueError, match="defines no g"):
        lines_of(counted, ["f", "g"])


def test_the_coarser_integrator_of_the_hysteresis_errs_far_less_than_the_noise():
    made = bouc_wen.problem().fitted[0]
    fine, coarse = (bouc_wen.position_m(made["force_N"], steps, *bouc_wen.TRUTH) for steps in (20, 4))
    assert np.max(np.abs(1e3 * (fine - coarse))) < 0.1 * bouc_wen.NOISE_MM


def test_what_the_pump_gives_is_in_the_tanks():
    """With the lower outlet shut and no brim, both levels sum to the pumped volume at every sample."""
    pump_V = tanks.problem().fitted[0]["pump_V"]
    shut = (0.05, 0.0, 0.04, np.inf, 0.0, 0.0, 0.0, np.inf, 0.0, 0.0, 0.0)
    lower = tanks.levels(pump_V, np.zeros((len(pump_V), 2)), *shut)
    pumped = np.concatenate([[0.0], 0.04 * tanks.SAMPLE_S * np.cumsum(pump_V)[:-1]])
    upper = pumped - lower
    assert np.all(upper > -1e-9)
    rate = np.gradient(lower, tanks.SAMPLE_S)
    np.testing.assert_allclose(rate[5:-5], 0.05 * np.sqrt(upper[5:-5]), rtol=0.1)


def test_the_upper_tank_overflows_in_both_records():
    for record in (*tanks.problem().fitted, *tanks.problem().held_out):
        given = tanks.problem().predict(record, dict(zip(("k1", "k3", "k4"), tanks.TRUTH, strict=False)))
        assert np.max(np.abs(given - record["level_V"])) > 10 * tanks.NOISE_V


def test_without_the_measured_records_it_says_so(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(emps, "DATA", emps.ROOT.parent / "nowhere")
    monkeypatch.setattr(bench_systems, "compare", lambda problem: {problem.key: 1.0})
    assert set(bench_systems.run()) == {"spring", "spring_withheld", "spring_nothing", "tanks", "bouc_wen"}
    assert "EMPS: skipped, DATA_EMPS.mat and DATA_EMPS_PULSES.mat not in nowhere" in capsys.readouterr().out


def test_an_effect_dropped_from_a_pair_leaves_the_other_as_it_was_in_company():
    """Fitted alone, the overflow stops at a brim that the level never reaches; beside a leak of 0 it is found."""
    answer = engine.solve(tanks.problem())
    assert answer.named == ("overflow",)
