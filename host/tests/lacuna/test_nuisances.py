"""Nuisances differ from run to run: if repeats share them, the effect that they follow is named, or a warning given."""

import numpy as np
import pytest

import lacuna
from lacuna import Effect, Parameter
from lacuna.diagnosis.nuisances import Followed, met_by_chance
from lacuna.estimation.fit import fit_base
from lacuna.records import read

TIME_S = np.linspace(0.0, 1.0, 60)
TEMPERATURES_K = (-10.0, -4.0, 0.0, 3.0, 7.0, 12.0)
SPREAD_MM, NOISE_MM = 0.3, 0.05


def simulate(record, theta):
    x = theta.gain * np.sin(2.0 * np.pi * record.time_s)
    drift = theta.expansion.mm_per_K * record["warmer_K"]
    return {"x_mm": x + theta.zero_mm + drift + theta.cubic.per_mm2 * x**3}


def system(spread_mm=SPREAD_MM):
    return lacuna.System(
        simulate,
        [Parameter("gain", "mm", 1.0, 0.1, 10.0)],
        [
            Effect("expansion", Parameter("mm_per_K", "mm/K", 0.05, -2.0, 2.0)),
            Effect("cubic", Parameter("per_mm2", "1/mm^2", 0.02, -0.5, 0.5)),
        ],
        nuisances=[Parameter("zero_mm", "mm", 0.0, -20.0 * spread_mm, 20.0 * spread_mm, scale=spread_mm)],
    )


def records(seed, of_condition, spread_mm=SPREAD_MM, per_mm2=0.0):
    """Four runs at each temperature, with a shift from `of_condition` in addition to each run's own zero."""
    x = 2.0 * np.sin(2.0 * np.pi * TIME_S)
    draw = np.random.default_rng(seed)
    return {
        f"{warmer_K:g} K, {run}": {
            "time_s": TIME_S,
            "warmer_K": warmer_K,
            "x_mm": x
            + per_mm2 * x**3
            + shift
            + spread_mm * draw.standard_normal()
            + NOISE_MM * draw.standard_normal(len(TIME_S)),
            "condition": f"{warmer_K:g} K",
        }
        for warmer_K, shift in zip(TEMPERATURES_K, of_condition, strict=True)
        for run in range(4)
    }


def followed(verdict):
    return [said for said in verdict.warnings if "zero_mm" in said and "between conditions" in said]


@pytest.fixture(scope="module")
def expanding():
    return lacuna.diagnose(system(), records(2, 0.08 * np.array(TEMPERATURES_K)), progress=False)


def test_what_nuisances_follow_is_named(expanding):
    assert [effect.name for effect in expanding.effects] == ["expansion"]
    lower, upper = expanding.effects[0].interval["mm_per_K"]
    assert 0.5 * lower < 0.08 < 2.0 * upper
    assert "zero_mm" in expanding.record["signature"]["text"]
    assert not followed(expanding)
    assert np.std([values["zero_mm"] for values in expanding.nuisances.values()]) < 1.5 * SPREAD_MM


@pytest.mark.slow
def test_nuisances_of_their_own_follow_nothing():
    for seed in range(3):
        found = lacuna.diagnose(system(), records(seed, np.zeros(6)), progress=False)
        assert found.verdict == "none"
        assert not [said for said in found.warnings if "zero_mm" in said], "neither by condition nor on average"


def test_what_a_condition_sets_is_told_and_no_effect_named():
    """A zero that differs between conditions without growing with the temperature causes a warning only."""
    found = lacuna.diagnose(system(), records(4, (0.7, -0.5, 0.6, -0.7, 0.5, -0.6)), progress=False)
    assert not found.effects
    assert len(followed(found)) == 1


@pytest.mark.parametrize("spread_mm", [5.0, 100.0])
def test_runs_that_differ_by_many_times_the_noise_hide_no_effect(spread_mm):
    found = lacuna.diagnose(system(spread_mm), records(0, np.zeros(6), spread_mm, 0.03), progress=False)
    assert [effect.name for effect in found.effects] == ["cubic"]
    lower, upper = found.effects[0].interval["per_mm2"]
    assert lower < 0.03 < upper
    assert lacuna.diagnose(system(spread_mm), records(0, np.zeros(6), spread_mm), progress=False).verdict == "none"


@pytest.mark.parametrize("spread_mm", [SPREAD_MM, 5.0, 100.0])
def test_a_base_fit_leaves_the_noise_however_far_apart_runs_begin(spread_mm):
    tables = read(records(1, np.zeros(6), spread_mm))
    fitted = fit_base(system(spread_mm), [table.record(["x_mm"]) for table in tables])
    left_mm = np.concatenate([left["x_mm"] for left in fitted.residuals().values()])
    assert np.sqrt(np.mean(left_mm**2)) == pytest.approx(NOISE_MM, rel=0.05)


@pytest.mark.parametrize("parameters", [1, 2])
def test_probability_of_meeting_conditions_by_chance(parameters):
    """The probability is uniform for an effect unrelated to the conditions, here a regression on random regressors."""
    draw, found = np.random.default_rng(5), []
    for _ in range(400):
        mean = draw.standard_normal(8)
        regressors = np.column_stack([np.ones(8), draw.standard_normal((8, parameters))])
        left = mean - regressors @ np.linalg.lstsq(regressors, mean, rcond=None)[0]
        was, now = ([np.full(3, value) for value in values] for values in (mean, left))
        found.append(met_by_chance({"q": was}, {"q": now}, [Followed("q", 1.0)], parameters))
    assert np.mean(found) == pytest.approx(0.5, abs=0.06)
    assert np.mean(np.array(found) < 0.1) == pytest.approx(0.1, abs=0.05)


@pytest.mark.slow
def test_no_share_of_a_gap_is_given_where_nuisances_had_closed_it(expanding, tmp_path):
    assert expanding.record["effects"][0]["share_of_gap"] is None
    assert "What was missing" in str(expanding)
    assert "of the gap" not in str(expanding)
    assert "no gap was measured" in expanding.report(tmp_path / "page.html").read_text()


def test_nuisances_that_are_all_a_little_off_are_pointed_out():
    """A warning is given if no nuisance is far off by itself, but their mean is by five standard errors."""
    found = lacuna.diagnose(system(), records(0, np.full(6, SPREAD_MM)), progress=False)
    (said,) = [one for one in found.warnings if one.startswith("zero_mm")]
    assert "on average over 24 trials, where 0 mm is expected" in said


@pytest.mark.parametrize("declared_mm", [0.3, 0.1])
def test_it_is_said_if_a_nuisance_varies_by_more_than_declared(declared_mm):
    """The true spread is 0.3 mm: neither model error in some runs nor an average that differs from zero."""
    found = lacuna.diagnose(system(declared_mm), records(5, np.zeros(6)), progress=False)
    said = [one for one in found.warnings if one.startswith("zero_mm")]
    if declared_mm == SPREAD_MM:
        assert not said
        return
    (said,) = said
    assert "where 0.1 mm is declared" in said
    assert float(said.split("scale=")[1].rstrip(".")) == pytest.approx(SPREAD_MM, rel=0.4)
