"""A plain function as a system: its failures during a search, and derivatives with respect to its factors."""

import math
import re

import heater
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lacuna
from lacuna import Effect, Parameter
from lacuna.coordinates import INVERSE, LOG
from lacuna.errors import DeclarationError, MisuseError
from lacuna.estimation.fit import spread_starts
from lacuna.estimation.noise import estimate_noise
from lacuna.estimation.problem import Problem
from lacuna.estimation.solve import solve
from lacuna.estimation.structure import Structure
from lacuna.records import Table, segments
from lacuna.run import with_records
from lacuna.values import Values


def test_what_a_loop_reads_of_an_effect_is_no_search_among_names():
    found = heater.system().values({}).with_attributes()
    assert vars(found)["gain_K_W"] == found["gain_K_W"] == 0.8
    assert vars(vars(found)["sensor_lag"])["lag_s"] == found.sensor_lag["lag_s"] == found["sensor_lag.lag_s"] == 0.0
    with pytest.raises(AttributeError, match="wire: there are gain_K_W"):
        _ = found.wire


@pytest.mark.parametrize("read", [lambda values: values, lambda values: values.with_attributes()])
def test_a_micro_sign_is_an_attribute_though_python_takes_it_for_a_greek_letter(read):
    found = read(Values({"\N{MICRO SIGN}": 0.2, "belt.\N{MICRO SIGN}_s": 0.3}))
    as_python_reads_it = "\N{GREEK SMALL LETTER MU}"
    assert getattr(found, as_python_reads_it) == 0.2
    assert getattr(found.belt, f"{as_python_reads_it}_s") == 0.3


def test_a_name_that_theta_does_not_have_is_answered_with_those_it_has():
    with pytest.raises(KeyError, match=r"dry friction: there are mass_kg, dry friction\.force_N"):
        _ = Values({"mass_kg": 1.0, "dry friction.force_N": 2.0})["dry friction"]


FAR = 1.3  # the model fails above this gain


def failing(how):
    def simulate(record, theta):
        found = theta.gain_K_W * record["power_W"] * (1.0 - np.exp(-record.time_s / theta.tau_s))
        return how(found) if theta.gain_K_W > FAR else found

    return heater.modelled(simulate)


def at_a_far_gain(system):
    trial = system.trials[0]
    theta = {"gain_K_W": system.coordinate("gain_K_W").fitted(2.0), "tau_s": math.log(12.0)}
    return system.predict_trials([theta], (), [trial])[0]["temperature_K"]


@pytest.mark.parametrize(
    "how", [lambda y: math.sqrt(-1.0), lambda y: y[:-5], lambda y: y + 1j, lambda y: 1.0 / math.sin(0.0)]
)
def test_a_search_goes_on_where_the_model_fails(how):
    found = at_a_far_gain(with_records(failing(how), heater.records(1)))
    assert found.shape == heater.TIME_S.shape
    assert np.isnan(found).all()


def fails_above(limit, how):
    """A warning about a model that fails above a gain, 0.9 K/W being the true one."""

    def simulate(record, theta):
        found = heater.bare(record, theta)
        return how(found) if theta.gain_K_W > limit else found

    verdict = lacuna.diagnose(heater.modelled(simulate), heater.records(2), progress=False)
    return " ".join(verdict.warnings)


@pytest.mark.parametrize(
    ("how", "cause"),
    [
        (lambda y: math.sqrt(-1.0), "ValueError: math domain error"),
        (lambda y: y[:-5], r"shape \(235,\), measured with"),
    ],
)
def test_says_that_a_fit_may_have_stopped_where_the_model_fails(how, cause):
    assert re.search(rf"gain_K_W = 0\.89 K/W may be where .* simulations fail.*{cause}", fails_above(0.89, how))
    assert "simulations fail" not in fails_above(1.0, how)


def test_any_other_error_of_the_model_says_where():
    def broken(y):
        raise RuntimeError("solver gave up")

    with pytest.raises(MisuseError, match=r"steps_4W_1.*RuntimeError: solver gave up at gain_K_W = 2, tau_s = 12"):
        at_a_far_gain(with_records(failing(broken), heater.records(1)))


def test_a_wrong_shape_from_the_start_is_refused():
    short = lacuna.System(lambda record, theta: {"temperature_K": np.zeros(3)}, heater.PARAMETERS)
    with pytest.raises(MisuseError, match=r"shape \(3,\)"):
        lacuna.diagnose(short, heater.records(1), progress=False)


@pytest.mark.parametrize("lower", [0.1, -1.0])
def test_the_derivative_by_a_factor_is_that_of_its_parameter(lower):
    """A factor's derivative is right in every coordinate (with a lower bound above 0, the logarithm is fitted)."""

    def simulate(record, theta):
        return {"temperature_K": theta.gain_K_W * theta.wobble * np.cumsum(record["power_W"])}

    def derivative(factor_of):
        wobble = Parameter("wobble", "", 1.0, 0.5, 2.0, scale=0.02, factor_of=factor_of)
        gain = Parameter("gain_K_W", "K/W", 2.0, lower, 10.0)
        system = with_records(lacuna.System(simulate, [gain], nuisances=[wobble]), heater.records(2))
        problem = Problem(Structure(system), system.trials, estimate_noise(system, system.trials))
        _, own = problem.jacobians(problem.start(), (0,), problem.first_steps())[0].dense()
        return own

    np.testing.assert_allclose(derivative(("gain_K_W",)), derivative(()), rtol=1e-3, atol=1e-6)


def test_the_completed_model_of_a_segment_gives_its_own_samples():
    def simulate(record, theta):
        return {"y": theta.slope * record.time_s + theta.bend.by * record.time_s**2}

    bend = Effect("bend", Parameter("by", "", 0.5, -5.0, 5.0))
    system = lacuna.System(simulate, [Parameter("slope", "", 1.0, -10.0, 10.0)], [bend])
    time = np.linspace(0.0, 4.0, 400)
    noise = 0.01 * np.random.default_rng(0).standard_normal(400)
    pieces = segments(Table("long", time, {"y": 2.0 * time + 0.3 * time**2 + noise}, {}), 10)
    verdict = lacuna.diagnose(system, pieces, progress=False)
    trial = pieces[5].record(["y"])
    for asked in (pieces[5], trial):
        np.testing.assert_allclose(verdict.model(asked)["y"], pieces[5].columns["y"], atol=0.05)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_records_that_the_model_cannot_predict_are_structure():
    def simulate(record, theta):
        found = heater.simulate(record, theta)["temperature_K"]
        return np.full(found.shape, np.nan) if np.max(record["power_W"]) > 5.0 else found

    system = heater.modelled(simulate, effects=(heater.SENSOR, heater.OFFSET, heater.DEAD))
    verdict = lacuna.diagnose(system, heater.records(), progress=False)
    assert verdict.verdict == "unexplained"
    assert "could not predict" in " ".join(verdict.warnings)


@pytest.mark.parametrize("how", [{"test": "nope"}, {"suspected": "nope"}])
def test_one_name_needs_no_brackets(how):
    with pytest.raises(MisuseError, match="'nope'"):
        lacuna.diagnose(heater.system(), heater.records(2), progress=pytest.fail, **how)


@pytest.mark.parametrize(
    ("plausible", "fitted"), [((0.0, 2.0), (0.1, 2.0)), ((0.5, 9.0), (0.5, 9.0)), ((-1.0, 2.0), (0.1, 2.0))]
)
def test_a_plausible_range_from_0_begins_at_the_bound_of_what_is_fitted_by_its_logarithm(plausible, fitted):
    system = lacuna.System(heater.simulate, Parameter("gain_K_W", "K/W", 1.0, 0.1, 5.0, plausible=plausible))
    assert system.parameters[0].plausible == pytest.approx(np.log(fitted))
    structure = Structure(system)
    drawn = [values[0] for values in spread_starts(structure, structure.start(), 20, 0)]
    assert np.log(0.1) <= min(drawn) < max(drawn) <= np.log(5.0)


def test_a_plausible_range_of_a_limit_has_an_end_where_its_inverse_has_one():
    def limited(lower):
        limit = Parameter("limit_W", "W", 8.0, lower, 99.0, plausible=(0.0, 20.0))
        return heater.system(Effect("saturation", limit, absent=np.inf)).effects["saturation"].parameters[0]

    assert limited(1.0).plausible == (0.05, 1.0)
    with pytest.raises(DeclarationError, match=r"limit_W: plausible is 0\.0 to 20\.0, of which its bounds leave no"):
        limited(0.0)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.01, 10.0), st.floats(0.01, 10.0), st.sampled_from([-1.0, 1.0]), st.booleans())
def test_a_model_is_never_asked_for_a_value_beyond_a_bound(bound, width, side, positive):
    """Fits end at the bound, beyond which the truth lies; the last step must not round to a value outside. If the
    range is `positive`, the logarithm is fitted."""
    far = bound + width if side < 0.0 else bound / (1.0 + width) if positive else bound - width - bound
    (lower, upper), truth, asked = sorted((bound, far)), bound + 0.3 * side * bound, []
    u = np.linspace(-1.0, 1.0, 50)

    def simulate(record, theta):
        asked.append(theta.gain)
        return {"y": theta.gain * record["u"]}

    noise = np.random.default_rng(0).standard_normal((3, 50))
    records = [{"time_s": np.arange(50.0), "u": u, "y": truth * (u + 0.01 * one)} for one in noise]
    gain = Parameter("gain", "1", 0.5 * (lower + upper), lower, upper)
    system = with_records(lacuna.System(simulate, [gain], outputs="y"), records)
    problem = Problem(Structure(system), system.trials, estimate_noise(system, system.trials))
    solve(problem, problem.start())
    assert lower <= min(asked)
    assert max(asked) <= upper


@given(st.floats(1e-3, 1e3), st.sampled_from([LOG, INVERSE]))
def test_a_bound_is_told_as_itself_from_every_coordinate(bound, coordinate):
    own = coordinate.within(Parameter("rate", "1/s", 1.5 * bound, bound, 2.0 * bound))
    assert own.told(own.fitted(bound)) == bound
    assert own.told(own.fitted(2.0 * bound)) == 2.0 * bound
    assert own.told(own.fitted(1.1 * bound)) == pytest.approx(1.1 * bound)
