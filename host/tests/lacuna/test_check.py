"""Misuse is refused before the search, by trial and channel; data and models that may mislead cause a warning."""

import math
import re
from copy import deepcopy
from dataclasses import replace

import heater
import numpy as np
import pytest
from heater import said_of
from toy import case_of

import lacuna
from lacuna.check import check
from lacuna.diagnosis.diagnose import diagnose
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.warn import impossible_signs
from lacuna.errors import DeclarationError, MisuseError, TooLittleDataError
from lacuna.records import RecordError
from lacuna.report.sentence import shares_in_words
from lacuna.run import with_records
from lacuna.system import CandidateExperiment, CorrectionSite, Effect, Parameter, Record, System

T = np.linspace(0.0, 1.0, 101)
COUNT = np.arange(101)
BEND = Parameter("by", "1/s^2", 0.5, -5.0, 5.0)
GAIN = Parameter("gain", "", 1.1, 0.0, 9.0)
RAMP = lacuna.System(lambda record, theta: theta.gain * record.time_s, GAIN)
LOSS = CorrectionSite("loss", "loss", "temperature (K)", "W", 0.0, 9.0, 0.1)
DRAW = np.random.default_rng(0)


class Line(System):
    """y = slope t, with a bend as an effect: the least that the documentation requires of a system."""

    name = "line"

    def __init__(self, **changes):
        self.parameters = (Parameter("slope", "1/s", 1.0, -10.0, 10.0),)
        self.effects = {"bend": Effect("bend", BEND)}
        self.trials = tuple(
            Record(f"run {k}", "pull", k // 3, T, {"y": (1 + k // 3) * T + 0.01 * DRAW.standard_normal(len(T))})
            for k in range(6)
        )
        self.__dict__.update(changes)

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        return {"y": (1 + trial.condition) * theta["slope"] * T + theta.get("bend.by", 0.0) * T**2}


TRIALS = Line().trials
Y, TWO = TRIALS[0].channels["y"], {"y": np.full(101, 2.0)}


def bending(trials=None, **told):
    return Line(effects={"bend": Effect("bend", BEND, **told)}, trials=trials or TRIALS)


def changed(**changes):
    """The pulls, the first of them changed."""
    first, *others = TRIALS
    return bending(experiments="pull", trials=(replace(first, **changes), *others))


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


@pytest.mark.parametrize(("found", "said"), REFUSED_PREDICTIONS.values(), ids=REFUSED_PREDICTIONS)
def test_refuses_a_prediction_of(found, said):
    system = Line(predict=lambda theta, effects, trial, **how: found(trial, theta))
    with pytest.raises(MisuseError, match=said):
        diagnose(system, on_progress=pytest.fail)  # before the search begins


def predicting(found):
    """What a search gets of a system whose `predict` returns `found()`."""
    system = Line(predict=lambda theta, effects, trial, **how: found())
    return system.predict_trials([{"slope": 2.0}], (), [TRIALS[0]])[0]["y"]


@pytest.mark.parametrize("found", [lambda: math.sqrt(-1.0), lambda: 1.0 / math.sin(0.0), lambda: {"y": T[1:]}])
def test_a_search_goes_on_where_a_system_of_ones_own_fails(found):
    assert np.isnan(predicting(found)).all()


def test_a_search_says_where_a_system_of_ones_own_breaks():
    with pytest.raises(MisuseError, match=r"trial run 0: the model raises IndexError: .* at slope = 2"):
        predicting(lambda: [][0])
    with pytest.raises(MisuseError, match="trial run 0, channel y: not predicted; the model returns x"):
        predicting(lambda: {"x": T})


def with_bend(found):
    """A line whose prediction is `found()` where its bend has a size."""
    straight = Line()

    def predict(theta, effects, trial, **how):
        return found() if theta.get("bend.by") else straight.predict(theta, effects, trial)

    return Line(predict=predict)


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (lambda: math.sqrt(-1.0), r"effect bend cannot be simulated .*\(bend.by = 0.05, .*run 0: ValueError: "),
        (lambda: {"y": T * np.nan}, "effect bend cannot be simulated at any .*run 0: the prediction is NaN"),
        (lambda: {"y": T[1:]}, r"run 0, channel y: predicted with shape \(100,\).* with effect bend"),
        (lambda: {"x": T}, "run 0, channel y: not predicted; the model returns x"),
    ],
)
def test_refuses_an_effect_whose_code_always_fails(found, said):
    with pytest.raises(MisuseError, match=said):
        diagnose(with_bend(found), on_progress=pytest.fail)


def test_an_effect_may_fail_at_some_of_its_sizes():
    def predict(theta, effects, trial, **how):
        if theta.get("bend.by", 0.0) > 0.1:
            raise ValueError("too bent")
        return {"y": (1 + trial.condition) * theta["slope"] * T + theta.get("bend.by", 0.0) * T**2}

    assert check(Line(predict=predict)) == ()


def test_an_effect_that_fails_is_not_said_to_fit_with_the_opposite_sign():
    def said(lifted):
        def predict(theta, effects, trial, **how):
            return {"y": theta["slope"] * T + (lifted if theta.get("bend.by") else 0.0)}

        low = [replace(t, channels={"y": T - 0.5 + 0.01 * DRAW.standard_normal(101)}) for t in TRIALS]
        lift = {"bend": Effect("bend", replace(BEND, lower=0.0))}
        base = case_of(Line(predict=predict, trials=low, effects=lift)).fit_base(1)
        return impossible_signs(base, POLICY)

    assert "bend would fit with a by below 0" in said(0.1)[0]
    assert said(np.nan) == []


def test_an_explanation_that_fails_on_the_test_records_is_said_to_fail():
    tried = [{"share_of_gap": 0.8}, {"share_of_gap": None}]
    assert shares_in_words(tried) == ["80 % of the gap", "could not be simulated"]
    assert shares_in_words(tried[1:]) == ["no gap was measured"]


REFUSED = {
    "run 0: time does not increase from sample 49": changed(time_s=np.where(T == 0.5, 0.2, T)),
    r"run 0: time does not increase from sample 2 \(2 s\)": changed(
        time_s=np.where(COUNT == 3, 1, COUNT).astype(np.uint32)
    ),
    "run 0: time does not increase from sample 90": changed(time_s=np.minimum(T, 0.9)),
    "run 0: time at sample 50 is not a number": changed(time_s=np.where(T == 0.5, np.nan, T)),
    r"channel y: measured with shape \(100,\), but the times have \(101,\)": changed(channels={"y": Y[1:]}),
    "run 0, channel y: measured values are <U3": changed(channels={"y": np.full(101, "1.0")}),
    "run 0, channel y: infinite at sample 50": changed(channels={"y": np.where(T == 0.5, np.inf, Y)}),
    "run 0, channel y: fewer than 8 valid samples": changed(channels={"y": np.full(101, np.nan)}),
    "run 0 has no channel": changed(channels={}),
    "trial run 1: more than one trial has this name": changed(name="run 1"),
    "run 0, channel y: effect bend .* push is not among its `experiments`": changed(experiment="push"),
    "run 0, channel y: constant, as in every trial of pull": Line(trials=[replace(t, channels=TWO) for t in TRIALS]),
    "effect bend is listed under the key curve": Line(effects={"curve": Effect("bend", BEND)}),
    "effect bend is freed at nowhere, which is not a correction site": bending(freed_at="nowhere"),
    "effect bend declares slope in `apart`, but that parameter has no `at_least`": bending(apart="slope"),
    "parameter slope: more than one": Line(parameters=2 * Line().parameters),
    "run 0: its nuisance slope": Line(nuisances=lambda trial: (Parameter("slope", "", 1.0, 0.0, 2.0),)),
}


@pytest.mark.parametrize("said", REFUSED)
def test_refuses_a_system_saying(said):
    with pytest.raises(MisuseError, match=said):
        diagnose(REFUSED[said], on_progress=pytest.fail)


@pytest.mark.parametrize(
    ("system", "said"),
    [
        (Line, r"Line is a class: give an instance, Line\(\.\.\.\)"),
        (Line(name=3), "Line.name is 3: give a string"),
        (Line(effects=(Effect("bend", BEND),)), "Line.effects is a tuple: give a mapping from names to effects"),
        (Line(effects={"bend": BEND}), r"Line.effects holds Parameter\(.*, which is a Parameter, not Effect"),
        (Line(parameters=BEND), "Line.parameters is a Parameter: give a sequence of Parameters"),
        (Line(trials=None), "Line.trials is a NoneType: give a sequence of Records"),
        (Line(trials=({"y": Y},) * 3), "Line.trials holds .*, which is a dict, not Record"),
    ],
)
def test_refuses_a_system_of_ones_own_that_declares_something_else(system, said):
    with pytest.raises(MisuseError, match=said):
        lacuna.diagnose(system, progress=pytest.fail)


@pytest.mark.parametrize("count", [0, 2])
def test_refuses_fewer_trials_than_needed(count):
    with pytest.raises(TooLittleDataError, match=f"{count} trials given: a diagnosis needs at least 3"):
        diagnose(Line(trials=Line().trials[:count]), on_progress=pytest.fail)


def test_refuses_repeats_of_different_inputs():
    records = heater.records(repeats=2)
    records["steps_4W_2"]["power_W"] = -records["steps_4W_2"]["power_W"]
    with pytest.raises(MisuseError, match=r"steps_4W_1 and steps_4W_2 are declared as repeats.*power_W differs"):
        lacuna.diagnose(heater.system(), records, progress=pytest.fail)


@pytest.mark.parametrize(("column", "what"), [("time_s", "times"), ("temperature_K", "column temperature_K")])
def test_refuses_a_record_without_a_column(column, what):
    records = heater.records(repeats=2)
    del records["sweep_4W_1"][column]
    with pytest.raises(RecordError, match=f"record sweep_4W_1 has no {what}"):
        lacuna.diagnose(heater.system(), records, progress=pytest.fail)


def test_refuses_to_guess_which_column_is_predicted():
    with pytest.raises(MisuseError, match="which of its columns"):
        with_records(lacuna.System(heater.bare, heater.PARAMETERS), heater.records(1))
    assert with_records(heater.modelled(heater.bare), heater.records(1)).trials
    assert declared(simulate=lambda record, theta: record).name == "<lambda>"


# -- declarations ---------------------------------------------------------------------------------------------


def declared(**told):
    return lacuna.System(**{"simulate": heater.simulate, "parameters": heater.PARAMETERS, **told})


NOT_IN_THETA = ("correction", "a.b", "gain_K_W", "items")
REFUSED_DECLARATIONS = {
    "effect dead_band is listed under the key curve": {"effects": {"curve": heater.DEAD}},
    "parameter gain_K_W is declared 2 times": {"parameters": 2 * heater.PARAMETERS},
    "copy": {"parameters": replace(GAIN, name="copy")},
    "at_least of gain names 'kinetic', which is no parameter": {"parameters": replace(GAIN, at_least="kinetic")},
    "gain cannot fall below slope, which may be 1e": {
        "parameters": (replace(GAIN, at_least="slope"), Parameter("slope", "", 1.0, 0.0, 1e9)),
    },
    "at_least of gain names 'by', which is no parameter that is fitted": {
        "parameters": (BEND, replace(GAIN, at_least="by")),
        "fixed": {"by": 0.2},
    },
    "apart of effect bend names 'slop', which is no parameter": {"effects": Effect("bend", BEND, apart="slop")},
    "absent at infinity": {"effects": replace(heater.LIMITED, parameters=Parameter("W", "W", 8.0, -1.0, np.inf))},
    "a typical value other than 0": {
        "effects": replace(heater.LIMITED, parameters=Parameter("W", "W", 0.0, 0.0, np.inf, scale=1.0))
    },
    r"curve 'loss\.left': choose another name, without a dot": {"curves": replace(LOSS, name="loss.left")},
    r"spare is a collection of conditions: write \['sweep 4 W'\]": {"spare": "sweep 4 W"},
    r"spare is a collection of conditions: write \[4\]": {"spare": 4},
    r"a spare condition is \['sweep', 4\], a list: give text, a number or a tuple": {"spare": iter([["sweep", 4]])},
    "noise_time_s is seconds": {"noise_time_s": "slow"},
} | {name: {"effects": Effect(name, BEND)} for name in NOT_IN_THETA}


@pytest.mark.parametrize("said", REFUSED_DECLARATIONS)
def test_refuses_a_declaration_saying(said):
    with pytest.raises(DeclarationError, match=said):
        declared(**REFUSED_DECLARATIONS[said])


@pytest.mark.parametrize("what", ["parameters", "effects", "nuisances", "curves", "experiments"])
def test_refuses_what_is_of_another_kind(what):
    with pytest.raises(DeclarationError, match="'gain' is of type str, not "):
        declared(**{what: ["gain"]})


@pytest.mark.parametrize(
    "told",
    [
        *({"accuracy": given} for given in ({"temperature_C": -1.0}, {"temperature_C": math.nan}, 0.1)),
        {"sensor_noise": {"temperature_C": "little"}},
        {"noise_time_s": -1.0},
    ],
)
def test_refuses_amounts_that_are_none(told):
    with pytest.raises(DeclarationError, match=f"{next(iter(told))} .*(not negative|by output)"):
        declared(**told)


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("none of the records has; there are", {"spare": ["10 V"]}),
        ("none of the records has; there are", {"accuracy": {"temperature": 0.1}}),
        ("none of the records has; there are", {"noise_time_s": {"temperature": 1.0}}),
        (
            "experiments of effect dead_band names 'rum'.*there are run",
            {"effects": replace(heater.DEAD, experiments="rum")},
        ),
        ("experiments of curve loss names 'rum'.*there are run", {"curves": replace(LOSS, experiments="rum")}),
    ],
)
def test_refuses_what_is_declared_of_nothing(said, told):
    with pytest.raises(DeclarationError, match=said):
        with_records(heater.modelled(heater.bare, **told), heater.records(1))


@pytest.mark.parametrize(
    "told",
    [
        *({"value": given} for given in ("1", 0.0, math.inf)),
        *({"lower": given} for given in (None, math.inf)),
        {"upper": "2"},
        *({"scale": given} for given in (0.0, -1.0, math.nan, math.inf, "1")),
        *({"prior_sd": given} for given in (0.0, -1.0, math.nan)),
        *({"grain": given} for given in (-1.0, math.nan, None)),
        *({"elsewhere": given} for given in (0.0, "1", None, (math.nan,))),
        *({"plausible": given} for given in ((2.0, 1.0), (0.5, math.inf), (math.nan, 1.0), (1.0,), 1.0, ("1", "2"))),
    ],
)
def test_refuses_a_parameter_that_is_none(told):
    """A negative spread of a nuisance, if accepted, would lead to another verdict."""
    why = "not a number|is not below|outside|fits begin there|a number above 0|not negative|the lower first"
    with pytest.raises(DeclarationError, match=f"gain: {next(iter(told))} .*({why})|is of type"):
        Parameter("gain", "", **{"value": 1.0, "lower": 0.1, "upper": math.inf, **told})


@pytest.mark.parametrize("bounds", [(-math.inf, math.inf), (0.0, math.inf)])
def test_refuses_a_parameter_that_does_not_say_which_change_of_it_matters(bounds):
    with pytest.raises(DeclarationError, match=r"rest: neither its value, 0, nor its range.*tells.*give `scale`"):
        Parameter("rest", "mm", 0.0, *bounds)
    assert Parameter("rest", "mm", 0.0, *bounds, scale=0.5).step_scale == 0.5


def test_refuses_a_parameter_whose_name_is_no_text():
    with pytest.raises(DeclarationError, match="a parameter's name is 1, which is a int, not text"):
        Parameter(1, "", 0.5, 0.0, 5.0)


def test_refuses_an_effect_whose_name_is_no_text():
    with pytest.raises(DeclarationError, match="an effect's name is None, which is a NoneType, not text"):
        Effect(None, BEND)


def test_refuses_a_record_whose_condition_cannot_be_compared():
    with pytest.raises(DeclarationError, match=r"record first: its condition is \['sweep', 4\], a list: give text"):
        Record("first", "heating", ["sweep", 4], np.arange(3.0), {"T_K": np.zeros(3)})


UNBOUNDED = {"lower": -math.inf, "upper": math.inf}
OF_ANOTHER_TYPE = "effect bend: `{}` is|is of type (int|NoneType), not"


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("effect bend: own phase needs finite bounds, or a scale", {"own": replace(BEND, name="phase", **UNBOUNDED)}),
        (
            "bend: gain has `at_least`, which is for base parameters",
            {"parameters": (BEND, replace(GAIN, at_least="by"))},
        ),
        ("bend: `frequency` is 'f', which is none of by, gain", {"parameters": (BEND, GAIN), "frequency": "f"}),
        ("bend: `frequency` is 'bend.by', which is none of by", {"frequency": "bend.by"}),
        *((OF_ANOTHER_TYPE.format(key), {key: 3}) for key in ("parameters", "own", "experiments", "freed_at", "apart")),
        *((OF_ANOTHER_TYPE.format("start_factors"), {"start_factors": given}) for given in ((), (math.nan,), None)),
        *((OF_ANOTHER_TYPE.format("absent"), {"absent": given}) for given in (math.nan, None, "0")),
    ],
)
def test_refuses_an_effect_that_is_none(said, told):
    with pytest.raises(DeclarationError, match=said):
        Effect(**{"name": "bend", "parameters": BEND, **told})


def test_numbers_of_numpy_are_numbers():
    assert replace(LOSS, knots=np.int64(5)).knots == 5
    assert Parameter("gain", "", np.float64(1.0), 0.1, 5.0, scale=np.float32(0.5)).scale == 0.5


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"lower": 9.0}, "9.0 to 9.0 is not a finite range"),
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


def test_a_limit_may_lie_below_zero():
    below = heater.system(Effect("saturation", Parameter("limit_W", "W", -8.0, -20.0, 0.0), absent=-np.inf))
    size = below.effects["saturation"].parameters[0]
    assert (size.lower, size.upper) == (-np.inf, -0.05)


def test_a_factor_that_cannot_be_absent_is_pointed_out():
    factor = Effect("stretch", Parameter("factor", "", 1.1, 0.5, 2.0))
    records = {f"{k}": {"time_s": T, "y": T + 0.01 * DRAW.standard_normal(len(T))} for k in range(4)}

    def multiplied(record, theta):
        return {"y": theta.stretch.factor * theta.gain * record.time_s}

    def added(record, theta):
        return {"y": theta.gain * record.time_s + 1e-6 * theta.stretch.factor}

    said = "Effect stretch is declared absent when its factor is 0, .*absent=1"
    with pytest.raises(MisuseError, match=said):
        said_of(records, lacuna.System(multiplied, GAIN, factor))
    (warning,) = said_of(records, lacuna.System(added, GAIN, factor))
    assert re.match(said, warning)
    assert not said_of(records, lacuna.System(added, GAIN, replace(factor, absent=1.0)))


# -- records ----------------------------------------------------------------------------------------------------


def test_where_every_condition_is_spare_nothing_is_left_to_be_fitted():
    records = heater.records(2)
    system = heater.system(spare={one["condition"] for one in records.values()})
    with pytest.raises(TooLittleDataError, match="Every condition is `spare`, so none is left to fit"):
        lacuna.diagnose(system, records, progress=False)


@pytest.mark.parametrize("start_s", [0.0, 1.7e9])
def test_refuses_repeats_on_a_clock_of_the_day(start_s):
    given = heater.records(2)
    for place, one in enumerate(given.values()):
        one["time_s"] = one["time_s"] + start_s + 500.0 * place
    said = f"one spans {start_s:.10g} to .* s and the other {start_s + 500.0:.10g} to .* s: .* from its own start"
    with pytest.raises(MisuseError, match=said):
        said_of(given)


def test_refuses_repeats_of_which_a_single_input_differs_if_it_matters():
    def simulate(record, theta):
        return {"y": theta.gain * record["volt"] * record.time_s}

    def one(volt, room_C):
        return {"time_s": T, "y": volt * T, "volt": volt, "room_C": room_C, "condition": "all"}

    system = lacuna.System(simulate, GAIN)
    said_of([one(2.0, 20.0), one(2.0, 25.0), one(2.0, 30.0)], system)
    with pytest.raises(MisuseError, match="their volt is 2 and 10"):
        said_of([one(2.0, 20.0), one(10.0, 20.0), one(2.0, 20.0)], system)


def test_refuses_regressors_that_are_no_samples():
    lists = heater.system(regressors=lambda record, prediction: {"power": record["power_W"].tolist()})
    said_of(heater.records(2), lists)
    single = heater.system(regressors=lambda record, prediction: {"power": 4.0})
    with pytest.raises(DeclarationError, match="regressor power"):
        said_of(heater.records(2), single)


def test_refuses_a_folder_that_is_none(tmp_path):
    with pytest.raises(RecordError, match="no such folder"):
        lacuna.diagnose(heater.system(), tmp_path / "elsewhere")


# -- warnings in the verdict ----------------------------------------------------------------------------------


def warned(system, **hidden):
    records = heater.records(repeats=2, seed=3, **hidden)
    return " ".join(lacuna.diagnose(system, records, progress=False).warnings)


def test_warns_of_trials_that_the_model_cannot_predict():
    def predict(theta, effects, trial, **how):
        return {"y": np.where(trial.condition, np.nan, theta["slope"] * T + theta.get("bend.by", 0.0) * T**2)}

    said = " ".join(diagnose(Line(predict=predict)).warnings)
    assert "cannot predict run 3, run 4, run 5" in said


@pytest.mark.slow
def test_warns_of_effects_that_no_record_was_left_to_test():
    three = dict(list(heater.records(repeats=1, seed=3, offset__power_W=2.0).items())[:3])
    verdict = lacuna.diagnose(heater.system(), three, progress=False)
    assert [effect.name for effect in verdict.effects] == ["offset"]
    assert any(said.startswith("No record was left to test these effects") for said in verdict.warnings)


@pytest.mark.slow
def test_warns_of_a_parameter_at_its_bound():
    tight = (Parameter("gain_K_W", "K/W", 0.5, 0.1, 0.7), heater.PARAMETERS[1])
    assert "gain_K_W is at its bound (0.7 K/W)" in warned(declared(parameters=tight, effects=heater.EFFECTS))


def test_warns_of_a_direction_that_the_data_leave_open():
    """The data determine only the product of the two parameters."""
    volts = Parameter("volts", "", 1.0, 0.01, 100.0)
    system = heater.modelled(lambda record, theta: theta.volts * heater.bare(record, theta), volts)
    assert "hardly determine a combination of gain_K_W, volts" in warned(system)


def test_what_the_data_leave_open_is_not_told_to_be_at_its_bound():
    idle = Parameter("idle", "", 1.0, 1.0, 3.0)
    system = heater.modelled(lambda record, theta: heater.bare(record, theta) + 1e-9 * theta.idle, idle)
    said = warned(system)
    assert "hardly determine idle" in said
    assert "bound" not in said


def test_the_size_of_an_effect_that_its_bound_stops_is_not_said_to_be_hardly_known():
    def slowing(w0, c, k):
        return (w0 + k / c) * np.exp(-10.0 * c * T) - k / c

    def simulate(record, theta):
        return {"w": slowing(record["w0"], theta.c, theta.dry.k)}

    dry = Effect("dry", Parameter("k", "rad/s2", 0.15, 0.0, 0.3))
    system = lacuna.System(simulate, Parameter("c", "1/s", 0.05, 0.001, 1.0), dry)
    draw = np.random.default_rng(0)
    wheels = [
        {"time_s": T, "w0": w0, "condition": w0, "w": slowing(w0, 0.08, 0.4) + 0.05 * draw.standard_normal(101)}
        for w0 in (10.0, 20.0, 30.0)
        for _ in range(3)
    ]
    said = " ".join(lacuna.diagnose(system, wheels, progress=False).warnings)
    assert "dry.k is at its bound (0.3 rad/s2)" in said
    assert "hardly known" not in said


def test_warns_of_a_nuisance_at_its_limit():
    records = heater.records(repeats=2, seed=3)
    records["steps_4W_1"]["temperature_K"] += 5.0
    drift = Parameter("drift_K", "K", 0.0, -50.0, 50.0, scale=0.05)
    system = heater.modelled(lambda record, theta: heater.bare(record, theta) + theta.drift_K, nuisances=drift)
    said = "drift_K is more than 3.5 standard deviations from its expected value in steps_4W_1"
    assert said in " ".join(lacuna.diagnose(system, records, progress=False).warnings)


@pytest.mark.parametrize(("declared_K", "doubted"), [(50.0, True), (2.0 * heater.NOISE_K, False)])
def test_warns_of_declared_noise_that_the_residual_refutes(declared_K, doubted):
    system = heater.system(sensor_noise={"temperature_K": declared_K})
    found = lacuna.diagnose(system, heater.records(repeats=2, seed=3, offset__power_W=2.0), progress=False)
    assert any("noise of 50 is declared, which hides everything smaller" in w for w in found.warnings) == doubted
    assert (found.verdict == "none") == doubted


@pytest.mark.slow
def test_warns_of_an_effect_that_would_need_the_opposite_sign():
    """The hidden offset is a loss of power; the library offers only a gain."""
    only_positive = replace(heater.OFFSET, parameters=Parameter("power_W", "W", 0.5, 0.0, 5.0))
    system = heater.system(heater.SENSOR, only_positive, heater.LIMITED, heater.DEAD)
    assert "offset would fit with a power_W below 0 W, which its bounds forbid" in warned(system, offset__power_W=-0.6)


def test_warns_of_a_parameter_that_changes_nothing():
    idle = heater.modelled(heater.bare, Parameter("unused", "", 1.0, 0.1, 10.0))
    assert said_of(heater.records(2), idle) == ("unused does not affect any prediction.",)


def test_a_gap_in_an_input_of_every_record_is_the_reason_why_nothing_is_predicted():
    given = heater.records(2)
    for one in given.values():
        one["power_W"][0] = np.nan
    with pytest.raises(
        MisuseError, match=r"the prediction is NaN.* Trial steps_4W_1, input power_W: no number at sample 0"
    ):
        said_of(given)


@pytest.mark.parametrize("places", [1, 3])
def test_warns_of_an_input_with_a_gap(places):
    outside_C = np.full((len(heater.TIME_S), places), 20.0)
    outside_C[7, -1] = np.nan
    outside_C = outside_C.squeeze()
    given = {name: one | {"outside_C": outside_C} for name, one in heater.records(2).items()}
    said = said_of(given)
    assert len(said) >= len(given)
    assert all("input outside_C: no number at sample 7" in sentence for sentence in said[: len(given)])


# -- clocks, repeats and arrays ---------------------------------------------------------------------------------


def counted(name, factor=1000.0):
    """The records with their times under another name, multiplied by a factor."""
    found = heater.records(2)
    for one in found.values():
        one[name] = one.pop("time_s") * factor
    return found


def test_milliseconds_for_seconds_are_pointed_out():
    said = said_of(counted("time"))
    assert any("500 s apart, too far to resolve even the longest time constant" in one for one in said)
    assert any("name it time_ms" in one for one in said)
    for name, factor in (("time", 1.0), ("time_ms", 1000.0)):
        assert not said_of(counted(name, factor))


def test_milliseconds_are_pointed_out_where_no_parameter_is_a_time():
    records = {f"{k}": {"time": np.arange(0, 2000, 10), "y": DRAW.standard_normal(200)} for k in range(4)}
    (said,) = said_of(records, RAMP)
    assert "10 s apart, and all times are whole numbers" in said


def test_which_of_two_clocks_was_taken_is_said():
    said = said_of({name: one | {"t": np.arange(len(one["time_s"]))} for name, one in heater.records(2).items()})
    assert any("times were taken from its column time_s; t is an input" in one for one in said)


def test_repeats_that_differ_by_a_setting_are_pointed_out():
    def days(*gains):
        each = (g * T + 0.01 * DRAW.standard_normal(101) for g in gains)
        return {f"{k}": {"time_s": T, "y": y, "condition": "pull"} for k, y in enumerate(each)}

    (said,) = said_of(days(1.0, 2.0, 3.0), RAMP)
    assert "0, 1, 2 are taken for repeats, but differ in y by" in said
    assert not said_of(days(1.0, 1.02, 0.99), RAMP)


def test_a_setting_is_pointed_out_in_records_whose_samples_are_not_even():
    times = np.repeat(np.linspace(0.0, 1.0, 50), 2) + np.tile([0.0, 1e-3], 50)
    given = {f"{k}": {"time_s": times, "y": g * times, "condition": "pull"} for k, g in enumerate((1.0, 2.0, 3.0))}
    (said,) = said_of(given, RAMP)
    assert "0, 1, 2 are taken for repeats, but differ in y by" in said


@pytest.mark.parametrize("column", ["power_W", "temperature_K", "time_s"])
def test_a_model_that_writes_into_what_it_is_given_is_told_the_column(column):
    def careless(record, theta):
        found = theta.gain_K_W * record["power_W"]
        samples = record.time_s if column == "time_s" else record[column]
        samples *= 2.0
        return found

    given = heater.records(2)
    before = deepcopy(given)
    with pytest.raises(MisuseError, match=f"simulate writes into {column}.*copy"):
        said_of(given, heater.modelled(careless))
    np.testing.assert_equal(given, before)


def test_a_model_may_return_one_array_again_and_again():
    """The threads of a search must not overwrite each other's results in it."""
    kept = np.empty(len(heater.TIME_S))

    def thrifty(record, theta):
        kept[:] = heater.simulate(record, theta)["temperature_K"]
        return kept

    given = heater.records(2, sensor_lag__lag_s=6.0)
    systems = (heater.modelled(one, effects=heater.EFFECTS) for one in (heater.simulate, thrifty))
    first, second = (lacuna.diagnose(system, given, progress=False) for system in systems)
    assert first.verdict == second.verdict == "identified"
    assert first.theta == second.theta


def test_refuses_an_experiment_on_offer_that_the_model_cannot_predict():
    record = with_records(heater.system(), heater.records(1)).trials[0]
    offer = CandidateExperiment("steps", {}, replace(record, name="longer", inputs={}))
    with pytest.raises(MisuseError, match="trial longer, channel temperature_K: the model raises KeyError"):
        said_of(heater.records(2), heater.system(experiments=offer))


@pytest.mark.parametrize("which", ["nuisances", "regressors"])
def test_a_function_that_fails_is_told_with_its_record(which):
    system = heater.system(**{which: lambda record, *_: record["nope"]})
    with pytest.raises(MisuseError, match=f"steps_4W_1: its {which} raise KeyError: 'nope: record"):
        lacuna.diagnose(system, heater.records(2), progress=pytest.fail)


def test_a_nuisance_that_starts_at_a_missing_sample_is_told_with_its_record():
    def start(record):
        return Parameter("start_K", "K", record["temperature_K"][0], -50.0, 50.0)

    given = heater.records(2)
    given["steps_4W_2"]["temperature_K"][0] = np.nan
    with pytest.raises(DeclarationError, match="trial steps_4W_2, its nuisances: start_K: value is nan"):
        lacuna.diagnose(heater.system(nuisances=start), given, progress=pytest.fail)


def test_refuses_a_model_that_follows_what_was_measured():
    """Predicting one step ahead hides what is missing; only starting from the first measured samples is allowed."""

    def following(record, theta):
        before = np.concatenate([[0.0], record["temperature_K"][:-1]])
        return before + theta.gain_K_W * record["power_W"] / theta.tau_s

    for records in (heater.records(2), lacuna.segments(heater.records(1)["steps_4W_1"], 5)):
        with pytest.raises(MisuseError, match=r"channel temperature_K: the prediction depends on the measured samples"):
            said_of(records, heater.modelled(following))


@pytest.mark.parametrize("kind", [np.float32, np.int32])
def test_a_model_may_have_what_was_measured_give_its_kind_and_drive_another_part(kind):
    """A difference in rounding must not pass for following the measurement; one output may be an input of the next."""

    def simulate(record, theta):
        free = np.zeros_like(record["temperature_K"])
        free += (theta.gain_K_W * record["power_W"] / theta.tau_s).astype(kind)
        return {"temperature_K": free, "double_K": 2.0 * theta.gain_K_W * record["temperature_K"]}

    records = heater.records(2)
    for one in records.values():
        one["temperature_K"] = (100.0 * one["temperature_K"]).astype(kind)
        one["double_K"] = 2.0 * one["temperature_K"]
    said_of(records, declared(simulate=simulate, outputs=("temperature_K", "double_K")))


@pytest.mark.parametrize(
    "how",
    [
        *({"starts": given} for given in (0, -1, 1.5, None, T)),
        *({"n_jobs": given} for given in (-2, 2.5, "2")),
        *({"seed": given} for given in (-1, 1.5, None, "now")),
        {"random_state": -1},
        {"executor": 3},
        *({"policy": given} for given in (None, {})),
        *({"progress": given} for given in ("yes", 1)),
    ],
)
def test_refuses_a_diagnosis_that_cannot_be_done_like_this(how):
    with pytest.raises(MisuseError, match=f"{next(iter(how))} is "):
        lacuna.diagnose(heater.system(), heater.records(1), **{"progress": pytest.fail, **how})


@pytest.mark.parametrize("records", [None, {}])
def test_refuses_a_function_in_place_of_a_system(records):
    with pytest.raises(MisuseError, match="the first must be a System, not function"):
        lacuna.diagnose(heater.simulate, records, progress=pytest.fail)
