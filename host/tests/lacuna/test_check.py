"""Every misuse is refused before the search, by the name of its trial and channel; what may mislead is a warning."""

import math
import re
from dataclasses import replace

import heater
import numpy as np
import pytest

import lacuna
from lacuna.check import check
from lacuna.diagnosis.diagnose import diagnose
from lacuna.errors import DeclarationError, MisuseError, TooLittleDataError
from lacuna.records import RecordError, falling
from lacuna.run import with_records
from lacuna.system import CandidateExperiment, CorrectionSite, Effect, Parameter, Record, System

T = np.linspace(0.0, 1.0, 101)
LOSS = CorrectionSite("loss", "loss", "temperature (K)", "W", 0.0, 9.0, 0.1)
DRAW = np.random.default_rng(0)


class Line(System):
    """y = slope t, with a bend on offer; written as the documentation says, and no more than that."""

    name = "line"

    def __init__(self, **changes):
        self.parameters = (Parameter("slope", "1/s", 1.0, -10.0, 10.0),)
        self.effects = {"bend": Effect("bend", Parameter("by", "1/s^2", 0.5, -5.0, 5.0))}
        self.trials = tuple(
            Record(f"run {k}", "pull", k // 3, T, {"y": (1 + k // 3) * T + 0.01 * DRAW.standard_normal(len(T))})
            for k in range(6)
        )
        self.__dict__.update(changes)

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        return {"y": (1 + trial.condition) * theta["slope"] * T + theta.get("bend.by", 0.0) * T**2}


def predicting(found):
    system = Line()
    system.predict = lambda theta, effects, trial, **how: found(trial, theta)
    return system


def changed(system, **changes):
    first, *others = system.trials
    return Line(trials=(replace(first, **changes), *others))


def raising(trial, theta):
    raise ValueError("no such valve")


REFUSED_PREDICTIONS = {
    "a scalar": (lambda t, p: {"y": np.float64(p["slope"])}, "run 0, channel y: predicted as float64"),
    "no dimension": (lambda t, p: {"y": np.array(1.0)}, r"run 0, channel y: predicted with shape \(\)"),
    "one sample less": (lambda t, p: {"y": T[1:]}, r"run 0, channel y: predicted with shape \(100,\)"),
    "a column vector": (lambda t, p: {"y": T[:, None]}, r"run 0, channel y: predicted with shape \(101, 1\)"),
    "a list": (lambda t, p: {"y": list(T)}, "run 0, channel y: predicted as list"),
    "complex numbers": (lambda t, p: {"y": T + 0j}, "run 0, channel y: predicted as array of complex"),
    "another channel": (lambda t, p: {"x": T}, "run 0, channel y: not predicted; the model returns x"),
    "no mapping": (lambda t, p: T, "run 0: the model returns ndarray"),
    "an exception": (raising, "run 0, channel y: the model raises ValueError: no such valve"),
    "NaN always": (lambda t, p: {"y": np.full(101, np.nan)}, "run 0, channel y: the prediction is NaN, as in every"),
    "NaN in a sample": (lambda t, p: {"y": np.where(T == 0.5, np.nan, T)}, "run 0, channel y: the prediction is NaN"),
    "a constant": (lambda t, p: {"y": np.ones(101)}, "run 0, channel y: no parameter changes the prediction"),
    "chance": (lambda t, p: {"y": p["slope"] * T + DRAW.standard_normal(101)}, "run 0, channel y: two predictions"),
    "an effect when off": (
        lambda t, p: {"y": p["slope"] * T + T**2 * ("bend.by" in p)},
        "run 0, channel y: effect bend changes the prediction although its size is 0",
    ),
}


@pytest.mark.parametrize("name", REFUSED_PREDICTIONS)
def test_refuses_a_prediction_of(name):
    found, said = REFUSED_PREDICTIONS[name]
    with pytest.raises(MisuseError, match=said):
        diagnose(predicting(found), on_progress=pytest.fail)  # before the search begins


Y = Line().trials[0].channels["y"]
REFUSED_RECORDS = {
    "times that fall": ({"time_s": np.where(T == 0.5, 0.2, T)}, "run 0: time does not increase from sample 49"),
    "times that stand": ({"time_s": np.minimum(T, 0.9)}, "run 0: time does not increase from sample 90"),
    "a time that is missing": ({"time_s": np.where(T == 0.5, np.nan, T)}, "run 0: time at sample 50 is not a number"),
    "another length": (
        {"channels": {"y": Y[1:]}},
        r"run 0, channel y: measured with shape \(100,\), but the times have \(101,\)",
    ),
    "text": ({"channels": {"y": np.full(101, "1.0")}}, "run 0, channel y: measured values are <U3"),
    "an infinity": ({"channels": {"y": np.where(T == 0.5, np.inf, Y)}}, "run 0, channel y: infinite at sample 50"),
    "nothing": ({"channels": {"y": np.full(101, np.nan)}}, "run 0, channel y: fewer than 8 valid samples"),
    "no channel": ({"channels": {}}, "run 0 has no channel"),
    "another's name": ({"name": "run 1"}, "trial run 1: more than one trial has this name"),
}


@pytest.mark.parametrize("name", REFUSED_RECORDS)
def test_refuses_a_record_with(name):
    changes, said = REFUSED_RECORDS[name]
    with pytest.raises(MisuseError, match=said):
        diagnose(changed(Line(), **changes), on_progress=pytest.fail)


def test_refuses_a_channel_that_is_constant_in_every_trial():
    trials = tuple(replace(t, channels={"y": np.full(101, 2.0)}) for t in Line().trials)
    with pytest.raises(MisuseError, match="run 0, channel y: constant, as in every trial of pull"):
        diagnose(Line(trials=trials), on_progress=pytest.fail)


def test_takes_a_channel_that_rests_in_one_trial_only():
    (said,) = check(changed(Line(), channels={"y": np.full(101, 2.0)}))
    assert "unlike its repeats" in said


def test_refuses_an_effect_under_another_key():
    effect = Effect("bend", Parameter("by", "1/s^2", 0.5, -5.0, 5.0))
    with pytest.raises(MisuseError, match="effect bend is listed under the key curve"):
        diagnose(Line(effects={"curve": effect}), on_progress=pytest.fail)
    with pytest.raises(DeclarationError, match="effect bend is listed under the key curve"):
        lacuna.System(heater.simulate, heater.PARAMETERS, {"curve": effect})


def test_refuses_an_effect_freed_where_there_is_no_curve():
    effect = Effect("bend", Parameter("by", "1/s^2", 0.5, -5.0, 5.0), freed_at=("nowhere",))
    with pytest.raises(MisuseError, match="effect bend is freed at nowhere, which is no correction site"):
        diagnose(Line(effects={"bend": effect}), on_progress=pytest.fail)


def test_refuses_an_effect_that_needs_apart_what_is_not_next_to_anything():
    effect = Effect("bend", Parameter("by", "1/s^2", 0.5, -5.0, 5.0), apart=("slope",))
    with pytest.raises(MisuseError, match="effect bend needs slope apart, which lacks"):
        diagnose(Line(effects={"bend": effect}), on_progress=pytest.fail)


@pytest.mark.parametrize("count", [0, 2])
def test_refuses_fewer_trials_than_needed(count):
    with pytest.raises(TooLittleDataError, match=f"{count} trials given: a diagnosis needs at least 3"):
        diagnose(Line(trials=Line().trials[:count]), on_progress=pytest.fail)


def test_refuses_names_that_are_used_twice():
    with pytest.raises(MisuseError, match="parameter slope: more than one"):
        diagnose(Line(parameters=(*Line().parameters, *Line().parameters)), on_progress=pytest.fail)
    system = Line()
    system.nuisances = lambda trial: (Parameter("slope", "", 1.0, 0.0, 2.0),)
    with pytest.raises(MisuseError, match="run 0: its nuisance slope"):
        diagnose(system, on_progress=pytest.fail)
    with pytest.raises(DeclarationError, match="parameter gain_K_W is declared 2 times"):
        lacuna.System(heater.simulate, (*heater.PARAMETERS, heater.PARAMETERS[0]))


def test_refuses_repeats_of_different_inputs():
    records = heater.records(repeats=2)
    records["steps_4W_2"]["power_W"] = -records["steps_4W_2"]["power_W"]
    with pytest.raises(MisuseError, match=r"steps_4W_1 and steps_4W_2 are declared as repeats.*power_W differs"):
        lacuna.diagnose(heater.system(), records, progress=pytest.fail)


@pytest.mark.parametrize(
    ("column", "said"),
    [("time_s", "has no times"), ("temperature_K", "has no column temperature_K")],
)
def test_refuses_a_record_without_a_column(column, said):
    records = heater.records(repeats=2)
    del records["sweep_4W_1"][column]
    with pytest.raises(RecordError, match=f"record sweep_4W_1 {said}"):
        lacuna.diagnose(heater.system(), records, progress=pytest.fail)


def test_refuses_to_guess_which_column_is_predicted():
    bare = lacuna.System(lambda record, theta: heater.simulate(record, theta)["temperature_K"], heater.PARAMETERS)
    with pytest.raises(MisuseError, match="which of its columns"):
        with_records(lacuna.System(_bare, heater.PARAMETERS, (heater.SENSOR,)), heater.records(1))
    named = lacuna.System(_bare, heater.PARAMETERS, (heater.SENSOR,), outputs="temperature_K")
    assert with_records(named, heater.records(1)).trials
    assert bare.name == "<lambda>"


def _bare(record, theta):
    return heater.lag(theta.gain_K_W * record["power_W"], theta.tau_s)


# -- declarations of a plain function -------------------------------------------------------------------------


def declared(effect="bend", parameter="slope", **told):
    return lacuna.System(
        lambda record, theta: record.time_s, [Parameter(parameter, "", 1.0, 0.0, 2.0)], [Effect(effect, BEND)], **told
    )


BEND = Parameter("by", "", 0.5, -5.0, 5.0)


@pytest.mark.parametrize(
    ("effect", "parameter"), [("correction", "slope"), ("a.b", "slope"), ("slope", "slope"), ("items", "slope")]
)
def test_refuses_names_that_theta_cannot_have(effect, parameter):
    with pytest.raises(DeclarationError, match=effect):
        declared(effect, parameter)
    with pytest.raises(DeclarationError, match="copy"):
        declared(parameter="copy")


@pytest.mark.parametrize(
    "told", [{"spare": ["10 V"]}, {"accuracy": {"temperature": 0.1}}, {"noise_time_s": {"temperature": 1.0}}]
)
def test_refuses_what_is_declared_of_nothing(told):
    with pytest.raises(DeclarationError, match="none of the records has; there are"):
        with_records(heater.system(**told), heater.records(1))


def test_refuses_an_effect_in_experiments_that_are_none():
    effects = (replace(heater.SENSOR, experiments=("rum",)), heater.OFFSET, heater.LIMITED, heater.DEAD)
    with pytest.raises(DeclarationError, match=r"experiments of effect sensor_lag names 'rum'.*there are run"):
        with_records(heater.system(*effects), heater.records(1))


def test_refuses_a_lower_bound_that_is_no_parameter():
    above = Parameter("static", "", 1.0, 0.0, 2.0, at_least="kinetic")
    with pytest.raises(DeclarationError, match="at_least of static names 'kinetic', which is no parameter"):
        lacuna.System(heater.simulate, [above])


@pytest.mark.parametrize("given", [("1", 0.0, 2.0), (1.0, None, 2.0), (1.0, 0.0, "2")])
def test_refuses_bounds_that_are_no_numbers(given):
    with pytest.raises(lacuna.LacunaError, match=r"gain: (value|lower|upper) is .*, not a number"):
        Parameter("gain", "", *given)


@pytest.mark.parametrize(
    "told",
    [
        *({"scale": given} for given in (0.0, -1.0, math.nan, math.inf, "1")),
        *({"prior_sd": given} for given in (0.0, -1.0, math.nan)),
        *({"grain": given} for given in (-1.0, math.nan, None)),
        *({"elsewhere": given} for given in (9.0, "1", None, (math.nan,))),
        {"value": math.inf},
    ],
)
def test_refuses_amounts_of_a_parameter_that_are_none(told):
    """A negative spread of a nuisance would be taken, and end in another verdict."""
    with pytest.raises(lacuna.LacunaError, match=f"gain: {next(iter(told))} |is of type"):
        Parameter("gain", "", **{"value": 1.0, "lower": 0.1, "upper": math.inf if "value" in told else 5.0, **told})


@pytest.mark.parametrize(
    "told",
    [
        *({"start_factors": given} for given in ((), (math.nan,), None)),
        *({"absent": given} for given in (math.nan, None, "0")),
        *({name: 3} for name in ("parameters", "own", "experiments", "freed_at", "apart")),
    ],
)
def test_refuses_an_effect_that_is_none(told):
    with pytest.raises(DeclarationError, match=f"effect bend: `{next(iter(told))}` is|is of type (int|NoneType), not"):
        Effect(**{"name": "bend", "parameters": BEND, **told})


def test_what_each_trial_has_of_its_own_begins_somewhere():
    with pytest.raises(DeclarationError, match="effect bend: own phase needs finite bounds, or a scale"):
        Effect("bend", BEND, own=Parameter("phase", "rad", 0.0, -math.inf, math.inf))


def test_numbers_of_numpy_are_numbers():
    assert replace(LOSS, knots=np.int64(5)).knots == 5
    assert Parameter("gain", "", np.float64(1.0), 0.1, 5.0, scale=np.float32(0.5)).scale == 0.5


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"lower": 9.0}, "9.0 to 9.0 is no finite range"),
        ({"upper": math.inf}, "0.0 to inf is no"),
        ({"lower": "0"}, "'0' to 9.0 is no"),
        *(({"scale": given}, f"scale is {given}") for given in (0.0, -0.1, math.nan)),
        *(({"knots": given}, f"1 rows of {given} knots: too few") for given in (0, 1, 2.5)),
        ({"rows": ()}, "0 rows of 9 knots: too few"),
    ],
)
def test_refuses_a_curve_that_is_none(told, said):
    with pytest.raises(DeclarationError, match=f"curve loss.*{said}"):
        CorrectionSite(**{**vars(LOSS), **told})


@pytest.mark.parametrize("what", ["parameters", "effects", "nuisances", "curves", "experiments"])
def test_refuses_what_is_of_another_kind(what):
    told = {"simulate": heater.simulate, "parameters": heater.PARAMETERS, what: ["gain"]}
    with pytest.raises(DeclarationError, match="'gain' is of type str, not "):
        lacuna.System(**told)


def test_a_factor_that_cannot_be_absent_is_pointed_out():
    factor = Effect("stretch", Parameter("factor", "", 1.1, 0.5, 2.0))

    def multiplied(record, theta):
        return {"y": theta.stretch.factor * theta.gain * record.time_s}

    def added(record, theta):
        return {"y": theta.gain * record.time_s + 1e-6 * theta.stretch.factor}

    records = {f"{k}": {"time_s": T, "y": T + 0.01 * DRAW.standard_normal(len(T))} for k in range(4)}
    gain = Parameter("gain", "", 1.5, 0.0, 2.0)
    said = "Effect stretch is absent where its factor is 0, .*absent=1"
    with pytest.raises(MisuseError, match=said):
        check(with_records(lacuna.System(multiplied, [gain], [factor]), records))
    (warning,) = check(with_records(lacuna.System(added, [gain], [factor]), records))
    assert re.match(said, warning)
    assert not check(with_records(lacuna.System(added, [gain], [replace(factor, absent=1.0)]), records))


def test_refuses_a_condition_where_conditions_belong():
    with pytest.raises(DeclarationError, match=r"\['sweep 4 W'\]"):
        heater.system(spare="sweep 4 W")
    with pytest.raises(DeclarationError, match=r"\[4\]"):
        heater.system(spare=4)


def test_where_every_condition_is_spare_nothing_is_left_to_be_fitted():
    records = heater.records(2)
    system = heater.system(spare={one["condition"] for one in records.values()})
    with pytest.raises(TooLittleDataError, match="Every condition is `spare`, and none is left to be fitted"):
        lacuna.diagnose(system, records, progress=False)


def test_refuses_an_infinite_size_that_may_be_of_either_sign():
    with pytest.raises(DeclarationError, match="absent at infinity"):
        heater.system(Effect("saturation", Parameter("limit_W", "W", 8.0, -1.0, np.inf), absent=np.inf))
    with pytest.raises(DeclarationError, match="its value be a typical one, which is not 0"):
        heater.system(Effect("saturation", Parameter("limit_W", "W", 0.0, 0.0, np.inf), absent=np.inf))
    below = heater.system(Effect("saturation", Parameter("limit_W", "W", -8.0, -20.0, 0.0), absent=-np.inf))
    size = below.effects["saturation"].parameters[0]
    assert (size.lower, size.upper) == (-np.inf, -0.05)


def test_refuses_repeats_on_a_clock_of_the_day():
    given = heater.records(2)
    for place, one in enumerate(given.values()):
        one["time_s"] = one["time_s"] + 500.0 * place
    with pytest.raises(MisuseError, match="from its own start"):
        check(with_records(heater.system(), given))


def test_refuses_repeats_of_which_a_single_input_differs_if_it_matters():
    def simulate(record, theta):
        return {"y": theta.gain * record["volt"] * record.time_s}

    def one(volt, room_C):
        return {"time_s": T, "y": volt * T, "volt": volt, "room_C": room_C, "condition": "all"}

    system = lacuna.System(simulate, [Parameter("gain", "", 1.1, -5.0, 5.0)])
    check(with_records(system, [one(2.0, 20.0), one(2.0, 25.0), one(2.0, 30.0)]))
    with pytest.raises(MisuseError, match="their volt is 2 and 10"):
        check(with_records(system, [one(2.0, 20.0), one(10.0, 20.0), one(2.0, 20.0)]))


def test_refuses_regressors_that_are_no_samples():
    lists = heater.system(regressors=lambda record, prediction: {"power": record["power_W"].tolist()})
    check(with_records(lists, heater.records(2)))
    single = heater.system(regressors=lambda record, prediction: {"power": 4.0})
    with pytest.raises(DeclarationError, match="regressor power"):
        check(with_records(single, heater.records(2)))


def test_refuses_words_among_the_inputs():
    given = heater.records(2)
    given["steps_4W_1"]["note"] = np.full(len(given["steps_4W_1"]["time_s"]), "windy")
    with pytest.raises(RecordError, match=r"record steps_4W_1, sample 0: column note .*windy.*leave the column out"):
        check(with_records(heater.system(), given))


def test_refuses_a_csv_that_is_no_table(tmp_path):
    (tmp_path / "a_1.csv").write_text("time_s,y\n0,1\n1\n")
    with pytest.raises(RecordError, match=r"a_1\.csv"):
        lacuna.diagnose(heater.system(), tmp_path, progress=pytest.fail)
    with pytest.raises(RecordError, match="no such folder"):
        lacuna.diagnose(heater.system(), tmp_path / "elsewhere")


# -- warnings in the verdict ----------------------------------------------------------------------------------


def warned(system, records):
    return " ".join(lacuna.diagnose(system, records, progress=False).warnings)


def test_warns_of_trials_that_the_model_cannot_predict():
    system = Line()
    whole = system.predict
    system.predict = lambda theta, effects, trial, **how: (
        whole(theta, effects, trial) if trial.name in ("run 0", "run 1", "run 2") else {"y": np.full(101, np.nan)}
    )
    said = " ".join(diagnose(system).warnings)
    assert "cannot predict run 3, run 4, run 5" in said


@pytest.mark.slow
def test_warns_of_a_parameter_at_its_bound():
    tight = (Parameter("gain_K_W", "K/W", 0.5, 0.1, 0.7), heater.PARAMETERS[1])
    said = warned(lacuna.System(heater.simulate, tight, _all()), heater.records(repeats=2, seed=3))
    assert "gain_K_W is at its bound (0.7 K/W)" in said


def test_warns_of_a_direction_that_the_data_leave_open():
    """A gain and the scale of what it multiplies cancel."""

    def simulate(record, theta):
        return {"temperature_K": heater.lag(theta.gain_K_W * theta.volts * record["power_W"], theta.tau_s)}

    parameters = (*heater.PARAMETERS, Parameter("volts", "", 1.0, 0.01, 100.0))
    said = warned(lacuna.System(simulate, parameters), heater.records(repeats=2, seed=3))
    assert "hardly determine a combination of gain_K_W, volts" in said


def test_what_the_data_leave_open_is_not_told_to_be_at_its_bound():
    def simulate(record, theta):
        warm = heater.lag(theta.gain_K_W * record["power_W"], theta.tau_s)
        return {"temperature_K": warm + 1e-9 * theta.idle}

    parameters = (*heater.PARAMETERS, Parameter("idle", "", 1.0, 1.0, 3.0))
    said = warned(lacuna.System(simulate, parameters), heater.records(repeats=2, seed=3))
    assert "hardly determine idle" in said
    assert "bound" not in said


def test_warns_of_a_nuisance_at_its_limit():
    def simulate(record, theta):
        return {"temperature_K": heater.lag(theta.gain_K_W * record["power_W"], theta.tau_s) + theta.drift_K}

    records = heater.records(repeats=2, seed=3)
    records["steps_4W_1"]["temperature_K"] = records["steps_4W_1"]["temperature_K"] + 5.0
    drift = Parameter("drift_K", "K", 0.0, -50.0, 50.0, scale=0.05)
    said = warned(lacuna.System(simulate, heater.PARAMETERS, nuisances=[drift]), records)
    assert "drift_K is more than 3.5 standard deviations from what is expected in steps_4W_1" in said


@pytest.mark.slow
def test_warns_of_an_effect_that_would_need_the_opposite_sign():
    """What is hidden is a loss of power, where only a gain of it is on offer."""
    only_positive = Effect("offset", Parameter("power_W", "W", 0.5, 0.0, 5.0))
    effects = (heater.SENSOR, only_positive, heater.LIMITED, heater.DEAD)
    said = warned(heater.system(*effects), heater.records(repeats=2, seed=3, offset__power_W=-0.6))
    assert "offset would fit with a power_W below 0 W, which its bounds forbid" in said


def test_warns_of_a_parameter_that_changes_nothing():
    idle = (*heater.PARAMETERS, Parameter("unused", "", 1.0, 0.1, 10.0))
    assert "unused does not affect any prediction" in warned(
        lacuna.System(heater.simulate, idle, _all()), heater.records(repeats=2, seed=3)
    )


def _all():
    return (heater.SENSOR, heater.OFFSET, heater.LIMITED, heater.DEAD)


@pytest.mark.parametrize(
    "told",
    [
        {"accuracy": {"temperature_C": -1.0}},
        {"accuracy": {"temperature_C": math.nan}},
        {"accuracy": 0.1},
        {"sensor_noise": {"temperature_C": "little"}},
        {"noise_time_s": -1.0},
    ],
)
def test_refuses_amounts_that_are_none(told):
    with pytest.raises(DeclarationError, match=f"{next(iter(told))} .*(not negative|by output)"):
        heater.system(**told)


def test_warns_of_an_input_with_a_gap():
    given = heater.records(2)
    for one in given.values():
        one["outside_C"] = np.where(np.arange(len(one["time_s"])) == 7, np.nan, 20.0)
    said = check(with_records(heater.system(), given))
    assert len(said) >= len(given)
    assert all("input outside_C: no number at sample 7" in sentence for sentence in said[: len(given)])


# -- clocks, repeats and arrays ---------------------------------------------------------------------------------


def counted(name, factor=1000.0):
    """The records with their times under another name, multiplied."""
    found = heater.records(2)
    for one in found.values():
        one[name] = one.pop("time_s") * factor
    return found


def test_milliseconds_for_seconds_are_pointed_out():
    said = check(with_records(heater.system(), counted("time")))
    assert any("samples are 500 s apart, and the longest time of the model is 12 s" in one for one in said)
    assert any("call it time_ms" in one for one in said)
    for name, factor in (("time", 1.0), ("time_ms", 1000.0)):
        assert not check(with_records(heater.system(), counted(name, factor)))


def test_milliseconds_are_pointed_out_where_no_parameter_is_a_time():
    records = {f"{k}": {"time": np.arange(0, 2000, 10), "y": DRAW.standard_normal(200)} for k in range(4)}
    system = lacuna.System(lambda record, theta: theta.gain * record.time_s, [Parameter("gain", "", 1.0, 0.0, 2.0)])
    (said,) = check(with_records(system, records))
    assert "10 s apart, all of them whole numbers" in said


def test_which_of_two_clocks_was_taken_is_said():
    given = heater.records(2)
    for one in given.values():
        one["t"] = np.arange(len(one["time_s"]))
    said = check(with_records(heater.system(), given))
    assert any("times were taken from its column time_s; t is an input" in one for one in said)


def test_repeats_that_differ_by_a_setting_are_pointed_out():
    system = lacuna.System(lambda record, theta: theta.gain * record.time_s, [Parameter("gain", "", 1.0, 0.0, 9.0)])

    def days(gains):
        return {
            f"{k}": {"time_s": T, "y": g * T + 0.01 * DRAW.standard_normal(101), "condition": "pull"}
            for k, g in enumerate(gains)
        }

    (said,) = check(with_records(system, days((1.0, 2.0, 3.0))))
    assert "0, 1, 2 are taken for repeats, but differ in y by" in said
    assert not check(with_records(system, days((1.0, 1.02, 0.99))))


@pytest.mark.parametrize("column", ["power_W", "temperature_K", "time_s"])
def test_a_model_that_writes_into_what_it_is_given_is_told_the_column(column):
    def careless(record, theta):
        found = {"temperature_K": theta.gain_K_W * record["power_W"]}
        samples = record.time_s if column == "time_s" else record[column]
        samples *= 2.0
        return found

    given = heater.records(2)
    before = {name: {key: np.copy(values) for key, values in one.items()} for name, one in given.items()}
    system = lacuna.System(careless, heater.PARAMETERS, outputs="temperature_K")
    with pytest.raises(MisuseError, match=f"simulate writes into {column}.*copy"):
        check(with_records(system, given))
    for name, one in before.items():
        for key, values in one.items():
            assert np.array_equal(given[name][key], values)


def test_a_model_may_return_one_array_again_and_again():
    """Nor do threads of a search write into it at a time."""
    kept = np.empty(len(heater.TIME_S))

    def thrifty(record, theta):
        kept[:] = heater.simulate(record, theta)["temperature_K"]
        return kept

    given = heater.records(2, sensor_lag__lag_s=6.0)
    found = []
    for one in (heater.simulate, thrifty):
        system = lacuna.System(one, heater.PARAMETERS, _all(), outputs="temperature_K")
        found.append(lacuna.diagnose(system, given, progress=False))
    assert found[0].record["verdict"] == found[1].record["verdict"] == "identified"
    assert found[0].theta == found[1].theta


# -- declarations that would lead nowhere -------------------------------------------------------------------------


@pytest.mark.parametrize("frequency", ["f", "hum.f_Hz"])
def test_refuses_a_frequency_that_is_no_parameter_of_the_effect(frequency):
    with pytest.raises(DeclarationError, match=f"hum: `frequency` is '{frequency}', which is none of size, f_Hz"):
        Effect("hum", (replace(BEND, name="size"), Parameter("f_Hz", "Hz", 2.0, 0.5, 10.0)), frequency=frequency)


def test_refuses_an_order_within_an_effect():
    with pytest.raises(DeclarationError, match="stick: high has `at_least`, which is for base parameters"):
        Effect("stick", (BEND, Parameter("high", "", 2.0, 0.5, 10.0, at_least="low")))


@pytest.mark.parametrize("plausible", [(2.0, 1.0), (0.5, math.inf), (math.nan, 1.0), (1.0,), 1.0, ("1", "2")])
def test_refuses_a_plausible_range_that_is_none(plausible):
    with pytest.raises(DeclarationError, match=r"gain: plausible is .*: give two numbers, the lower first"):
        Parameter("gain", "", 1.0, 0.1, 5.0, plausible=plausible)


def test_refuses_to_part_what_is_no_parameter():
    with pytest.raises(DeclarationError, match="apart of effect bend names 'slop', which is no parameter"):
        lacuna.System(heater.simulate, heater.PARAMETERS, Effect("bend", BEND, apart=("slop",)))


def test_refuses_curves_in_experiments_that_are_none_and_of_names_with_a_dot():
    site = CorrectionSite("loss", "loss", "temperature (K)", "W", 0.0, 9.0, 0.1, experiments=("rum",))
    with pytest.raises(DeclarationError, match=r"experiments of curve loss names 'rum'.*there are run"):
        with_records(heater.system(curves=site), heater.records(1))
    with pytest.raises(DeclarationError, match=r"curve 'loss\.left': choose another name, without a dot"):
        heater.system(curves=replace(site, name="loss.left"))


def test_refuses_an_effect_that_acts_in_other_experiments_than_its_own():
    first, *others = Line().trials
    bend = Effect("bend", BEND, experiments=("pull",))
    with pytest.raises(MisuseError, match=r"run 0, channel y: effect bend .* push is none of its `experiments`"):
        check(Line(effects={"bend": bend}, trials=(replace(first, experiment="push"), *others)))


def test_refuses_an_experiment_on_offer_that_the_model_cannot_predict():
    record = with_records(heater.system(), heater.records(1)).trials[0]
    offer = CandidateExperiment("steps", {}, replace(record, name="longer", inputs={}))
    with pytest.raises(MisuseError, match="trial longer, channel temperature_K: the model raises KeyError"):
        check(with_records(heater.system(experiments=[offer]), heater.records(2)))


@pytest.mark.parametrize("which", ["nuisances", "regressors"])
def test_a_function_that_fails_is_told_with_its_record(which):
    system = heater.system(**{which: lambda record, *_: record["nope"]})
    with pytest.raises(MisuseError, match=f"steps_4W_1: its {which} raise KeyError: 'nope: record"):
        lacuna.diagnose(system, heater.records(2), progress=pytest.fail)


def test_unsigned_times_may_not_fall_either():
    assert falling(np.array([0, 1, 2, 1, 3], np.uint32)).startswith("time does not increase from sample 2 (2 s)")


def test_refuses_a_model_that_follows_what_was_measured():
    """One step ahead of it nothing seems to be missing; a start from the first samples is no such thing."""

    def simulate(record, theta):
        before = np.concatenate([[0.0], record["temperature_K"][:-1]])
        return {"temperature_K": before + theta.gain_K_W * record["power_W"] / theta.tau_s}

    system = lacuna.System(simulate, heater.PARAMETERS, outputs="temperature_K")
    whole = {"time_s": heater.TIME_S, **next(iter(heater.records(1).values()))}
    for records in (heater.records(2), lacuna.segments(whole, 5)):
        with pytest.raises(MisuseError, match=r"channel temperature_K: the prediction follows what was measured"):
            check(with_records(system, records))


@pytest.mark.parametrize("kind", [np.float32, np.int32])
def test_a_model_may_have_what_was_measured_give_its_kind_and_drive_another_part(kind):
    """Rounded otherwise it would seem to follow what was measured; and one output may be an input of the next."""

    def simulate(record, theta):
        free = np.zeros_like(record["temperature_K"])
        free += (theta.gain_K_W * record["power_W"] / theta.tau_s).astype(kind)
        return {"temperature_K": free, "double_K": 2.0 * theta.gain_K_W * record["temperature_K"]}

    records = heater.records(2)
    for one in records.values():
        one["temperature_K"] = (100.0 * one["temperature_K"]).astype(kind)
        one["double_K"] = 2.0 * one["temperature_K"]
    check(with_records(lacuna.System(simulate, heater.PARAMETERS, outputs=("temperature_K", "double_K")), records))


@pytest.mark.parametrize(
    "how",
    [
        *({"starts": given} for given in (0, -1, 1.5, None, T)),
        *({"n_jobs": given} for given in (-2, 2.5, "2")),
        *({"seed": given} for given in (-1, 1.5, None, "now")),
        {"random_state": -1},
        {"executor": 3},
        {"policy": None},
        {"policy": {}},
        {"progress": "yes"},
        {"progress": 1},
    ],
)
def test_refuses_a_diagnosis_that_cannot_be_done_like_this(how):
    with pytest.raises(MisuseError, match=f"{next(iter(how))} is "):
        lacuna.diagnose(heater.system(), heater.records(1), **{"progress": pytest.fail, **how})


@pytest.mark.parametrize("records", [None, {}])
def test_refuses_a_function_in_place_of_a_system(records):
    with pytest.raises(MisuseError, match="the first is a System, not function"):
        lacuna.diagnose(heater.simulate, records, progress=pytest.fail)
