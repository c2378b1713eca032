"""One long record without repeats: the right mechanisms from the default settings, however effects are parametrised."""

from types import SimpleNamespace

import heater
import numpy as np
import pytest
from scipy.optimize import least_squares
from toy import slow

import lacuna
from lacuna import Effect, Parameter
from lacuna.errors import MisuseError
from lacuna.misfit import compare_at_misfit
from lacuna.records import RecordError
from lacuna.run import with_records

pytestmark = pytest.mark.slow

LIMIT = {"saturation__limit_W": 8.0}
BOTH = LIMIT | {"sensor_lag__lag_s": 3.0}


def record(seed, samples=4000, slow_K=0.0, **hidden):
    """Temperature under a random staircase of power. `slow_K`: SD of noise with a correlation time of 10 s."""
    draw = np.random.default_rng(seed)
    power_W = np.repeat(draw.uniform(-12.0, 12.0, samples // 60 + 1), 60)[:samples]
    wander_K = slow_K * slow(draw.standard_normal(samples), np.exp(-heater.SAMPLE_S / 10.0))
    temperature_K = heater.measured(power_W, seed, **hidden) + wander_K
    return {"time_s": heater.SAMPLE_S * np.arange(samples), "power_W": power_W, "temperature_K": temperature_K}


def diagnosed(one, *effects, **told):
    return lacuna.diagnose(heater.system(*effects, **told), lacuna.segments(one), progress=False)


def named(verdict):
    return {e.name for e in verdict.effects}


@pytest.mark.parametrize("slow_K", [0.0, 0.3])
def test_names_both_effects_by_segments_of_one_run(slow_K):
    found = diagnosed(record(3, slow_K=slow_K, **BOTH))
    assert named(found) == {"sensor_lag", "saturation"}
    assert "Without repeats" in str(found)
    assert "fast noise of the residual" in str(found).replace("\n", " ")


def test_the_answer_is_the_same_in_either_parametrisation():
    """Both parametrisations are fitted in one coordinate, so the results are equal, not just similar."""
    one = record(4, slow_K=0.3, **LIMIT)
    limit, inverse = (
        diagnosed(one, heater.SENSOR, heater.OFFSET, size, heater.DEAD) for size in (heater.LIMITED, heater.INVERSE)
    )
    assert named(limit) == named(inverse) == {"saturation"}
    assert limit.error == pytest.approx(inverse.error, rel=1e-6)
    assert limit.effects[0].parameters["limit_W"] == pytest.approx(
        1.0 / inverse.effects[0].parameters["per_limit_1_W"], rel=1e-6
    )


def test_error_is_no_worse_than_scipys_with_twenty_starts_on_the_same_structure():
    one, names = record(5, slow_K=0.1, **BOTH), ["gain_K_W", "tau_s", "sensor_lag.lag_s", "saturation.limit_W"]
    found = diagnosed(one)
    assert named(found) == {"sensor_lag", "saturation"}
    residual = heater.residuals_of([one], names)
    lower, upper = [0.1, 1.0, 0.0, 1.0], [5.0, 100.0, 20.0, 100.0]
    draw = np.random.default_rng(0)
    starts = [draw.uniform(lower, upper) for _ in range(20)]
    best = min(least_squares(residual, start, bounds=(lower, upper)).cost for start in starts)
    mine = 0.5 * np.sum(residual([found.theta[name] for name in names]) ** 2)
    assert mine <= 1.001 * best


def test_windows_begin_in_states_of_their_own():
    def simulate(record, theta):
        start = theta.start_K * np.exp(-record.time_s / theta.tau_s)
        return {"temperature_K": heater.simulate(record, theta)["temperature_K"] + start}

    def start(record):
        first = float(np.mean(record["temperature_K"][:3]))
        return [Parameter("start_K", "K", first, first - 5.0, first + 5.0, scale=0.3)]

    effects = (heater.OFFSET, heater.LIMITED, heater.DEAD, heater.SENSOR)
    system = lacuna.System(simulate, heater.PARAMETERS, effects, nuisances=start)
    windows = lacuna.windows(record(6, **LIMIT), 150.0)
    found = lacuna.diagnose(system, windows, progress=False)
    assert named(found) == {"saturation"}
    assert found.effects[0].parameters["limit_W"] == pytest.approx(8.0, rel=0.05)

    coming = {"time_s": windows[0].time_s, "power_W": windows[0].columns["power_W"]}
    predicted = found.model(coming, {"start_K": 2.0})["temperature_K"]
    np.testing.assert_array_equal(predicted, found.model(windows[0], {"start_K": 2.0})["temperature_K"])
    missing = {"temperature_K": np.full(len(windows[0].time_s), np.nan)}
    for unmeasured, said in ((coming, "KeyError: .temperature_K"), (coming | missing, "start_K: lower nan")):
        with pytest.raises(MisuseError, match=rf'{said}.*\. Give their values: model\(record, {{"start_K": ...}}\)'):
            found.model(unmeasured)


def test_slow_noise_without_an_effect_is_said_to_be_either():
    left = diagnosed(record(3, slow_K=0.3))
    assert left.verdict == "unexplained"
    (said,) = [w for w in left.warnings if "correlation time" in w]
    seconds = float(said.split("about ")[1].split(" s")[0])
    assert 5.0 < seconds < 15.0  # the truth is 10 s


@pytest.mark.parametrize("told", [10.0, {"temperature_K": 10.0}, "estimated"])
def test_noise_that_is_told_or_estimated_to_be_slow_is_noise(told):
    found = diagnosed(record(3, slow_K=0.3), noise_time_s=told)
    assert found.verdict == "none"
    assert "correlation time" in str(found).replace("\n", " ")
    (noise,) = found.diagnosis.search.floor.channels.values()
    assert noise.sd == pytest.approx(0.3, rel=0.3)


def test_slow_noise_hides_no_effect_that_is_larger():
    found = diagnosed(record(4, slow_K=0.3, **LIMIT), noise_time_s="estimated")
    assert named(found) == {"saturation"}


@pytest.mark.parametrize("cut", [lacuna.windows, lacuna.segments])
def test_a_clock_that_restarts_is_not_cut(cut):
    time_s = np.r_[np.arange(200), np.arange(200)] * 0.1
    with pytest.raises(RecordError, match=r"time does not increase from sample 199 \(19.9 s\) to the next \(0 s\)"):
        cut({"time_s": time_s, "power_W": time_s, "temperature_K": time_s}, 5)


def test_a_period_makes_windows_repeats():
    tables = lacuna.windows(record(7, samples=2400), 100.0, period=300.0)
    assert [t.labels["condition"] for t in tables[:4]] == ["from 0 s", "from 100 s", "from 200 s", "from 0 s"]
    assert all(t.time_s[0] == 0.0 and len(t.time_s) == 200 for t in tables)
    assert len({t.labels["condition"] for t in lacuna.windows(record(7, samples=2400), 100.0)}) == len(tables)


def test_a_segment_is_the_end_of_a_run_from_the_beginning():
    one = record(8, samples=600)
    system = heater.system()
    whole, *_, last = [with_records(system, [t]).trials[0] for t in lacuna.segments(one, 5)]
    values = system.values({"gain_K_W": np.log(0.9), "tau_s": np.log(15.0)})
    free = heater.simulate(one, values)["temperature_K"]
    np.testing.assert_allclose(system.run(last, values)["temperature_K"], free[480:])
    np.testing.assert_allclose(system.run(whole, values)["temperature_K"], free[:120])


def test_too_short_a_record_is_refused():
    with pytest.raises(RecordError, match="too short for three windows"):
        lacuna.windows(record(8, samples=600), 150.0)
    with pytest.raises(RecordError, match="too few for 100 segments, at most 75"):
        lacuna.segments(record(8, samples=600), 100)
    with pytest.raises(
        RecordError, match="23 samples: too few for 10 segments, at least 24 samples are needed for three"
    ):
        lacuna.segments(record(8, samples=23))
    with pytest.raises(RecordError, match="one long record"):
        lacuna.segments([record(8), record(9)])


def _found(verdict, left, floor):
    """A stub of a diagnosis: the residual that the best explanation leaves in one channel, and its floor."""
    trial = SimpleNamespace(name="a", experiment="run")
    final = SimpleNamespace(residuals=lambda: {"a": {"y": np.full(9, left)}}, problem=SimpleNamespace(trials=(trial,)))
    floors = SimpleNamespace(channels={("run", "y"): SimpleNamespace(sd=floor)})
    return SimpleNamespace(verdict=verdict, final=final, search=SimpleNamespace(floor=floors), is_stopped=False)


def test_explanations_far_above_the_floor_are_compared_at_a_fraction_of_what_they_leave():
    """With the floor raised to 0.05 a better explanation is found, which leaves less than that; with 0.002, none is."""
    raised = []

    def again(system):
        raised.append(round(system.sensor_noise("run", "y"), 9))
        return _found("identified", 0.04, raised[-1])

    first = _found("unexplained", 1.0, 0.001)
    found, was = compare_at_misfit(heater.system(), first, again)
    assert raised == [0.05, 0.002]
    assert found.search.floor.channels["run", "y"].sd == 0.05
    assert was == {("run", "y"): 0.001}


@pytest.mark.parametrize(
    ("verdict", "left", "floor"), [("identified", 0.009, 0.001), ("none", 1.0, 0.001), ("unexplained", 21.0, 1.0)]
)
def test_near_the_floor_or_without_a_gap_nothing_is_compared_again(verdict, left, floor):
    """A misfit of 21 floors would raise the floor by 5 % only, too little to change a comparison."""
    first = _found(verdict, left, floor)
    assert compare_at_misfit(heater.system(), first, pytest.fail) == (first, {})


def test_where_a_raised_floor_hides_everything_the_first_answer_stands():
    first = _found("unexplained", 1.0, 0.001)
    assert compare_at_misfit(heater.system(), first, lambda system: _found("none", 1.0, 0.05)) == (first, {})


def power_law(gain, effect, power, **told):
    """y = gain u, and an effect in a power of u."""

    def simulate(record, theta):
        return theta.gain * record["u"] + theta[f"{effect.name}.gain"] * record["u"] ** power

    return lacuna.System(simulate, gain, effect, outputs="y", **told)


@pytest.mark.parametrize(("cubic", "verdict"), [(0.3, "identified"), (0.0, "none")])
def test_a_record_that_is_itself_fast_does_not_pass_for_noise(cubic, verdict):
    """At nine samples per period, second differences of the record do not measure the noise."""
    draw, time_s = np.random.default_rng(0), np.arange(0.0, 1.0, 0.002)

    def measured(size):
        u = size * np.cos(2 * np.pi * 55.0 * time_s + draw.uniform(0.0, 6.0)) * (1.0 + 0.3 * np.sin(7.0 * time_s))
        return {"time_s": time_s, "u": u, "y": u + cubic * u**3 + 1e-3 * draw.standard_normal(len(u))}

    system = power_law(Parameter("gain", "", 0.8, 0.0, 5.0), Effect("cubic", Parameter("gain", "", 0.1, -2.0, 2.0)), 3)
    found = lacuna.diagnose(system, [measured(0.2 + 0.1 * k) for k in range(8)], progress=False)
    assert found.verdict == verdict
    assert "Repeats share" not in str(found)
    if verdict == "identified":
        assert found.effects[0].parameters["gain"] == pytest.approx(cubic, rel=0.02)


HEAVY = "declare its RMS: sensor_noise={"


@pytest.mark.parametrize("kind", ["outliers", "proportional"])
def test_fast_noise_that_is_not_even_may_be_declared(kind):
    """The floor is the typical distance of neighbours, which noise with outliers exceeds in RMS."""
    draw, u = np.random.default_rng(2), 5.0 + 4.0 * np.sin(np.linspace(0.0, 40.0, 1600))
    shape = draw.standard_t(3, len(u)) if kind == "outliers" else 0.02 * u**2 * draw.standard_normal(len(u))
    records = lacuna.segments({"time_s": np.arange(len(u)) * 0.1, "u": u, "y": 2.0 * u + shape}, 8)

    def found(**told):
        cubic = Effect("cubic", Parameter("gain", "", 0.01, -1.0, 1.0))
        model = power_law(Parameter("gain", "", 1.5, 0.0, 5.0), cubic, 3, **told)
        return lacuna.diagnose(model, records, progress=False)

    first = found()
    assert first.verdict == "unexplained"
    (said,) = [w for w in first.warnings if HEAVY in w]
    told = float(said.split('"y": ')[1].split("}")[0])
    assert found(sensor_noise={"y": told}).verdict == "none"


@pytest.mark.parametrize("bend", [0.0, 0.2])
def test_a_table_in_no_order_does_not_hide_what_its_residual_follows(bend):
    draw = np.random.default_rng(4)
    u = draw.uniform(0.0, 5.0, 200)
    table = {"u": u, "y": 2.0 * u + bend * u**2 + 0.02 * draw.standard_normal(200)}
    square = Effect("square", Parameter("gain", "", 0.1, -3.0, 3.0))
    model = power_law(Parameter("gain", "", 1.5, -5.0, 5.0), square, 2)

    def found(order):
        rows = {"time_s": np.arange(200), **{name: column[order] for name, column in table.items()}}
        return lacuna.diagnose(model, lacuna.segments(rows), progress=False)

    shuffled, ordered = found(np.arange(200)), found(np.argsort(u))
    said = [warning for warning in shuffled.warnings if "sort them by that" in warning]
    assert (shuffled.verdict, len(said)) == ("none", 1 if bend else 0)
    assert ordered.verdict == ("identified" if bend else "none")


@pytest.mark.parametrize("noise_time_s", [10.0, "estimated"])
def test_an_output_that_is_sampled_more_seldom_than_its_noise_changes_has_a_floor(noise_time_s):
    """A correlation time that is declared for all outputs; of one of them, every sixtieth sample is known."""
    one = record(4, slow_K=0.3)
    draw = np.random.default_rng(5)
    one["wall_K"] = np.full(len(one["time_s"]), np.nan)
    one["wall_K"][::60] = 0.5 * heater.measured(one["power_W"], 3)[::60] + 0.1 * draw.standard_normal(67)

    def simulate(record, theta):
        found = heater.simulate(record, theta)["temperature_K"]
        return {"temperature_K": found, "wall_K": 0.5 * found}

    system = lacuna.System(simulate, heater.PARAMETERS, heater.EFFECTS, noise_time_s=noise_time_s)
    found = lacuna.diagnose(system, lacuna.segments(one, 5), progress=False)
    assert found.verdict == "none"
    assert "could not predict" not in str(found)
    assert 0.05 < found.diagnosis.search.floor.channels["run", "wall_K"].sd < 0.15
