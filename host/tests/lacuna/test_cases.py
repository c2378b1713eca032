"""Regression tests: systems on which the engine once decided wrongly, with invented numbers."""

import numpy as np
import pytest
from heater import said_of

import lacuna
from lacuna import Effect, Parameter
from lacuna.coordinates import INVERSE, LIMITS, PLAIN, of_size
from lacuna.diagnosis.split import split_trials
from lacuna.system import Record, middle_conditions

GAIN = [Parameter("gain", "1", 1.0, 0.1, 10.0)]


def test_rivals_that_are_the_same_mechanism_are_named_as_a_group():
    def simulate(record, theta):
        u, square = record["u"], sum(v for k, v in theta.items() if k.startswith("square"))
        return {"y": theta.gain * u + square * u**2}

    draw, records = np.random.default_rng(0), []
    for _ in range(10):
        u = draw.uniform(0, 3) * np.sin(np.linspace(0, 20, 200)) + draw.normal(0, 0.3)
        y = 2.0 * u + 0.3 * u**2 + 0.05 * draw.standard_normal(200)
        records.append({"time_s": np.arange(200.0), "u": u, "y": y})
    effects = [Effect(f"square_{k}", Parameter("per", "1", 0.3, -5.0, 5.0)) for k in range(3)]
    found = lacuna.diagnose(lacuna.System(simulate, GAIN, effects), records, progress=False)
    (named,) = found.effects
    assert {named.name, *named.confusable_with} == {"square_0", "square_1", "square_2"}
    assert named.probability > 0.99
    assert found.theta[f"{named.name}.per"] == named.parameters["per"], "both are from the same fit"


def test_nothing_is_named_that_predicts_what_chose_nothing_worse():
    def simulate(record, theta):
        return {"y": theta.gain * record["u"] + theta.offset.y}

    draw, records = np.random.default_rng(0), []
    for n in range(10):
        u = np.sin(np.linspace(0, 20, 200)) + draw.normal(0, 0.3, 200)
        y = 2.0 * u + (-0.6 if n in (4, 9) else 1.0) + 0.05 * draw.standard_normal(200)
        records.append({"time_s": np.arange(200.0), "u": u, "y": y})
    system = lacuna.System(simulate, GAIN, [Effect("offset", Parameter("y", "1", 1.0, -5.0, 5.0))])
    found = lacuna.diagnose(system, records, progress=False)
    assert (found.verdict, found.effects) == ("unexplained", ())
    assert "the test records (record 5, record 10) get worse" in found.warnings[0]


def test_what_is_in_every_set_of_weight_is_named_however_little_is_closed_by_the_rest():
    """The data contain a, b, c and a term that no effect explains; d is absent, but much like b + c/2."""
    t, draw, records = np.linspace(0, 20, 300), np.random.default_rng(0), []

    def simulate(record, theta):
        a, b, c = (record[k] for k in "abc")
        d = b + 0.44 * c + 0.15 * record["level"] * np.cos(7 * t)
        return {
            "y": theta.gain * record["u"] + theta.a.size * a + theta.b.size * b + theta.c.size * c + theta.d.size * d
        }

    for level in (1.0, 2.0, 3.0, 4.0):
        u, a = np.sin(t), np.sign(np.cos(t))
        b, c = level * a * np.cos(3 * t), level * np.cos(5 * t)
        for _ in range(3):
            y = u + 10 * a + 0.8 * b + 0.35 * c + 0.3 * level * np.cos(9 * t) + 0.1 * draw.standard_normal(len(t))
            records.append(
                {"time_s": t, "u": u, "a": a, "b": b, "c": c, "y": y, "level": level, "condition": f"{level:g}"}
            )
    effects = [Effect(k, Parameter("size", "1", 1.0, -30.0, 30.0)) for k in "abcd"]
    found = lacuna.diagnose(lacuna.System(simulate, GAIN, effects), records, progress=False)
    assert found.verdict == "identified"
    assert found.effects[0].name == "a"
    assert {e.name for e in found.effects} <= {"a", "b", "c"}
    assert all(e.share_of_gap >= 0.0 for e in found.effects)


@pytest.mark.parametrize(
    ("forgotten", "which", "it"),
    [(("lost",), "Effect lost changes", "it"), (("lost", "left"), "Effects lost, left change", "them")],
)
def test_effects_that_the_model_never_uses_are_pointed_out(forgotten, which, it):
    def simulate(record, theta):
        return {"y": theta.gain * record["u"] + theta.used.per * record["u"] ** 2}

    draw, records = np.random.default_rng(0), []
    for _ in range(6):
        u = draw.uniform(-1, 1, 100)
        records.append({"time_s": np.arange(100.0), "u": u, "y": 2.0 * u + 0.05 * draw.standard_normal(100)})
    effects = [Effect(name, Parameter("per", "1", 0.3, -5.0, 5.0)) for name in ("used", *forgotten)]
    assert said_of(records, lacuna.System(simulate, GAIN, effects)) == (
        f"{which} no prediction at any of the start sizes: does the model use {it}, and do these records excite {it}?",
    )


def test_fits_with_a_limit_begin_where_it_is_declared_and_on_both_sides_of_it():
    assert 1.0 in LIMITS
    assert min(LIMITS) < 1.0 < max(LIMITS)
    limit = Effect("clip", Parameter("limit_V", "V", 10.0, 3.0, np.inf), absent=np.inf)
    plain = Effect("drag", Parameter("per", "1", 0.1, 0.0, 1.0))
    own = Effect("clip", Parameter("limit_V", "V", 10.0, 3.0, np.inf), absent=np.inf, start_factors=0.5)
    begins = [
        lacuna.System(lambda r, t: r.time_s, GAIN, [e]).effects[e.name].start_factors for e in (limit, plain, own)
    ]
    assert begins == [LIMITS, (0.1, 0.4, 1.2), (0.5,)]


@pytest.mark.parametrize(
    ("ends", "fitted"), [((0.0, np.inf), INVERSE), ((1.0, 1e9), INVERSE), ((-np.inf, np.inf), PLAIN)]
)
def test_a_limit_of_one_sign_is_fitted_as_its_inverse(ends, fitted):
    assert of_size(Parameter("limit", "W", 8.0, *ends), 1e6) is fitted


def test_of_three_repeated_conditions_the_middle_one_is_never_fitted_unless_one_says_which():
    t = np.linspace(0.0, 1.0, 20)
    trials = [
        Record(f"{c}{k}", "run", c, t, {"y": level + t})
        for c, level in (("c", 3), ("a", 1), ("b", 2))
        for k in range(3)
    ]
    assert middle_conditions(trials) == (("run", "b"),)
    assert middle_conditions(trials[:6]) == ()
    split = split_trials(trials, middle_conditions(trials))
    assert {t.condition for t in split.known} == {"a", "c"}
    assert [t.name for t in split.conditions] == ["b2"]


def test_a_limit_beside_a_stronger_effect_is_tried_though_none_of_its_sizes_helps_as_it_is():
    """A quadratic drain and an output clipped at 11.9 V: with the drain as fitted alone, each start size of `clip` (the
    declared 10 V and others) changes nothing or makes the fit worse."""
    n = 60

    def simulate(record, theta):
        x, found = 0.0, np.empty(n)
        for i, u in enumerate(record["u"]):
            found[i] = min(x, theta.clip.limit_V)
            for _ in range(4):
                x += (theta.gain * u - x - theta.drain.per_V * x * abs(x)) / theta.tau_s
        return {"y": found}

    parameters = [Parameter("gain", "1", 3.0, 0.1, 30.0), Parameter("tau_s", "s", 10.0, 1.0, 100.0)]
    effects = [
        Effect("drain", Parameter("per_V", "1/V", 0.05, 0.0, 1.0)),
        Effect("clip", Parameter("limit_V", "V", 10.0, 3.0, np.inf), absent=np.inf),
    ]
    system, draw, records = lacuna.System(simulate, parameters, effects), np.random.default_rng(0), []
    truth = system.values({"gain": np.log(6.0), "tau_s": np.log(12.0), "drain.per_V": 0.2, "clip.limit_V": 1 / 11.9})
    for _ in range(8):
        u = np.repeat(draw.uniform(0, 8, 10), 6)
        y = simulate({"u": u}, truth)["y"] + 0.02 * draw.standard_normal(n)
        records.append({"time_s": np.arange(float(n)), "u": u, "y": y})
    found = lacuna.diagnose(system, records, progress=False)
    assert {e.name for e in found.effects} == {"drain", "clip"}
    assert abs(found.theta.clip.limit_V - 11.9) < 0.1
