"""Without repeats, cross-validation predicts every known record once from the others."""

import numpy as np
import pytest
from toy import NOBODY, case_of

import lacuna
from lacuna import Effect, Parameter
from lacuna.diagnosis.cross_fit import cross_fitted, is_due
from lacuna.diagnosis.search import Search
from lacuna.estimation.fit import fit
from lacuna.estimation.structure import Structure
from lacuna.run import with_records

NOISE = 0.2


def simulate(record, theta):
    return {"y": theta.level + theta.bend.per_x2 * record["x"] ** 2}


def system(simulate=simulate, *decoys):
    effects = (Effect("bend", Parameter("per_x2", "", 0.5, -5.0, 5.0)), *decoys)
    return lacuna.System(simulate, Parameter("level", "", 1.0, -10.0, 10.0), effects, sensor_noise={"y": NOISE})


def records(seed, count, bend=0.0, steps=0.0, **more):
    """Records of a bend. `steps`: standard deviation of the level between records."""
    draw, other = np.random.default_rng(seed), np.random.default_rng([seed, 1])
    time_s = np.linspace(0.0, 1.0, 40)
    return [
        {
            "name": f"r{k}",
            "time_s": time_s,
            "x": (x := time_s + 0.1 * k),
            "y": 2.0 + steps * other.standard_normal() + bend * x**2 + NOISE * draw.standard_normal(40),
        }
        | more
        for k in range(count)
    ]


def measured(*given, **more):
    return case_of(with_records(system(), records(*given, **more)))


def judged(case):
    base = case.judge(case.fit_base(1))
    return cross_fitted(case, Search(base, base.fitted.problem.floor, (base,), ()), NOBODY).base


def test_each_record_is_predicted_by_the_mean_of_the_others():
    """For a constant model the errors are those of leave-one-out in closed form."""
    found = judged(measured(1, 5, steps=0.3))
    known = found.fitted.problem.trials
    assert sorted(found.errors) == sorted(trial.name for trial in known)
    sd = found.fitted.problem.floor.channels["run", "y"].sd
    for one in known:
        others = np.mean([trial.channels["y"].mean() for trial in known if trial is not one])
        expected = np.sqrt(np.mean((one.channels["y"] - others) ** 2)) / sd
        assert found.errors[one.name] == pytest.approx(expected, rel=3e-3)


def test_it_is_due_where_nothing_is_repeated():
    assert is_due(measured(1, 5))
    assert not is_due(measured(1, 5, condition="same"))


def test_an_effect_is_judged_alone_though_more_sets_than_are_compared_cost_less_with_it():
    """The right effect alone is judged even if its pairs with each of many decoys all cost a little less."""
    decoys = [Effect(f"decoy_{k}", Parameter("per_x", "", 0.5, -5.0, 5.0)) for k in range(12)]

    def with_decoys(record, theta):
        tilts = sum(theta[f"decoy_{k}.per_x"] * np.sin((k + 1) * record["x"]) for k in range(12))
        return {"y": simulate(record, theta)["y"] + tilts}

    told = with_records(system(with_decoys, *decoys), records(3, 7, bend=0.6))
    case = case_of(told)
    base = case.judge(case.fit_base(1))
    floor, known = base.fitted.problem.floor, case.split.fit
    sets = [(), ("bend",), *(("bend", decoy.name) for decoy in decoys)]
    tried = [case.judge(fit(Structure(told, effects), known, floor)) for effects in sets]
    alone, pairs = tried[1], tried[2:]
    assert sum(pair.fitted.cost < alone.fitted.cost for pair in pairs) == 12
    for pair in pairs:  # whatever their parameters add to the cost
        pair.__dict__["cost"] = min(pair.cost, alone.cost - 1e-3)
    found = cross_fitted(case, Search(tried[0], floor, tuple(tried), ()), NOBODY)
    assert found.with_effects(("bend",)) is not None


def test_the_names_do_not_depend_on_the_order_of_the_records():
    given = records(2, 7, bend=0.6)
    found = [lacuna.diagnose(system(), given[k:] + given[:k], progress=False) for k in range(7)]
    assert {tuple(e.name for e in one.effects) for one in found} == {("bend",)}


def test_records_that_show_more_than_those_fitted_are_told():
    """A warning tells that the bend shows where x is largest, in the one final test record."""
    given = records(2, 7, bend=0.3)
    found = lacuna.diagnose(system(), given[2:] + given[:2], progress=False)
    assert found.verdict == "none"
    assert any("The test records (r6) are predicted with an error of 1.39 times the noise" in w for w in found.warnings)
    assert not lacuna.diagnose(system(), records(2, 7), progress=False).warnings
