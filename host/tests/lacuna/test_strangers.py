"""What strangers' systems and records do that ours did not: each once gave a wrong answer or a raw error."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import lacuna
from lacuna import Effect, Parameter, Record
from lacuna.diagnosis import diagnose as engine
from lacuna.diagnosis.workers import STOPPED
from lacuna.misfit import compare_at_misfit
from lacuna.run import with_records

GAIN, TAU = Parameter("gain", "", 0.8, 0.1, 5.0), Parameter("tau_s", "s", 1.0, 0.1, 10.0)


def lag(u, tau_s, sample_s=0.2):
    keep = np.exp(-sample_s / tau_s) if tau_s > 0.0 else 0.0
    return lfilter([1.0 - keep], [1.0, -keep], u)


def diagnose(system, records):
    return lacuna.diagnose(system, records, progress=False)


def lagging(record, theta):
    return lag(theta.gain * lag(record["u"], theta.tau_s), theta.sensor.lag_s)


SENSOR = Effect("sensor", Parameter("lag_s", "s", 0.5, 0.0, 10.0))


def test_an_accuracy_of_many_floors_passes_no_larger_error():
    """The base model is off by 0.19 mm, ten times the accuracy; residuals that large are compressed in the test."""
    t, records, draw = np.arange(0, 40, 0.2), [], np.random.default_rng(0)
    for c in range(5):
        u = np.sign(np.sin(0.2 * (c + 1) * t)) * (1 + 0.2 * c)
        clean = lag(lag(u, 1.5), 1.2)
        records += [{"u": u, "y_mm": clean + 5e-5 * draw.standard_normal(200), "condition": c} for _ in range(2)]
    records = [{"time_s": t, **record} for record in records]
    found = {}
    for accuracy in (0.02, 0.5):
        system = lacuna.System(lagging, [GAIN, TAU], SENSOR, outputs="y_mm", accuracy={"y_mm": accuracy})
        found[accuracy] = diagnose(system, records).verdict
    assert found == {0.02: "identified", 0.5: "none"}


def test_windows_of_runs_under_different_conditions_are_no_repeats():
    t, draw = np.arange(0, 120, 0.1), np.random.default_rng(0)
    u = np.sign(np.sin(2 * np.pi * t / 20))
    labels = [
        {"name": "monday", "condition": "light"},
        {"name": "friday", "condition": "heavy"},
        {"name": "unlabelled"},
    ]
    runs = [{"time_s": t, "u": u, "y": u + 0.1 * draw.standard_normal(1200), **label} for label in labels]
    conditions = [[w.labels["condition"] for w in lacuna.windows(run, 10.0, period=20.0)] for run in runs]
    assert [sorted(set(one)) for one in conditions] == [
        ["light, from 0 s", "light, from 10 s"],
        ["heavy, from 0 s", "heavy, from 10 s"],
        ["from 0 s", "from 10 s"],
    ]


def test_windows_of_uneven_records_have_no_samples_in_common():
    step_s = np.where(np.arange(4000) % 5 < 3, 0.010, 0.0145)
    record = {"time_s": np.cumsum(step_s), "y": np.arange(4000.0)}
    windows = lacuna.windows(record, 2.0)
    samples = np.concatenate([w.columns["y"] for w in windows])
    assert len(samples) == len(np.unique(samples))
    assert max(w.time_s[-1] for w in windows) < 2.02


def test_without_a_scale_a_tenth_of_the_range_is_meant_however_wide():
    assert Parameter("p", "Pa", 0.0, -1e7, 1e7).step_scale == pytest.approx(2e6)


def test_a_nuisance_of_a_segment_is_made_from_the_run_that_is_simulated():
    """Every segment is simulated from the run's begin, so that its start is the run's."""
    run = {"time_s": np.arange(200.0), "y": np.linspace(3.0, 5.0, 200)}
    start = [Parameter("start", "", 3.0, -20.0, 20.0)]

    def nuisances(record):
        return Parameter("start", "", float(record["y"][0]), -20.0, 20.0)

    system = lacuna.System(lambda r, th: th.gain * r["y"], GAIN, outputs="y", nuisances=nuisances)
    known = with_records(system, lacuna.segments(run, 5))
    assert [known.nuisances(trial)[0].value for trial in known.trials] == [start[0].value] * 5


def test_repeats_may_lack_outputs():
    t, records, draw = np.arange(0, 20, 0.2), [], np.random.default_rng(0)
    for c in range(3):
        for j in range(2):
            u = np.sin(0.3 * (c + 1) * t)
            channels = {"y": u + 0.1 * draw.standard_normal(100)}
            channels |= {} if j else {"z": u**2 + 0.1 * draw.standard_normal(100)}
            records.append(Record(f"{c}_{j}", "run", c, t, channels, inputs={"u": u}))
    system = lacuna.System(lambda r, th: {"y": th.gain * r["u"], "z": (th.gain * r["u"]) ** 2}, GAIN)
    assert diagnose(system, records).verdict == "none"


def test_what_is_nearest_without_repeats_is_told_from_what_was_cross_validated():
    t, records, draw = np.arange(0, 20, 0.2), [], np.random.default_rng(590)
    for c in range(5):
        u = (1 + 0.3 * c) * np.sin(0.3 * (c + 1) * t)
        records.append({"time_s": t, "u": u, "y": lag(u, 1.5) + 0.05 + 0.1 * draw.standard_normal(100)})
    offset = Effect("off", Parameter("b", "", 0.02, -1.0, 1.0))
    system = lacuna.System(lambda r, th: th.gain * lag(r["u"], th.tau_s) + th.off.b, [GAIN, TAU], offset, outputs="y")
    found = diagnose(system, records)
    assert found.verdict in {"identified", "unexplained"}
    assert found.effects or any("off is not supported" in warning for warning in found.warnings)


def test_a_single_value_that_only_an_effect_uses_and_repeats_differ_in_is_pointed_out():
    t, records, draw = np.arange(0, 60, 0.1), [], np.random.default_rng(0)
    for k in range(4):
        u = np.sin(0.1 * (k + 1) * t)
        for load in (0.0, 1.0):
            y = lag((0.8 + 0.3 * load) * u, 3.0, 0.1) + 0.02 * draw.standard_normal(600)
            records.append({"time_s": t, "u": u, "condition": k, "load": load, "y": y})
    sag = Effect("sag", Parameter("k", "", 0.1, -1.0, 1.0))
    system = lacuna.System(
        lambda r, th: lag((th.gain + th.sag.k * r["load"]) * r["u"], th.tau_s, 0.1), [GAIN, TAU], sag, outputs="y"
    )
    assert any("a different load, which the base model does not use" in w for w in diagnose(system, records).warnings)


@pytest.mark.parametrize(
    ("frequency", "phase"),
    [
        (Parameter("f_Hz", "Hz", 0.5, 0.1, np.inf), Parameter("phase", "rad", 0.0, 0.0, 6.2832, periodic=True)),
        (Parameter("f_Hz", "Hz", 0.5, 0.1, 2.0), Parameter("phase", "rad", 0.0, -np.inf, np.inf, scale=2.0)),
    ],
    ids=["of the frequency", "of a phase of each record"],
)
def test_an_infinite_bound_does_not_keep_a_hum_from_being_found(frequency, phase):
    t, records, draw = np.arange(0, 40, 0.1), [], np.random.default_rng(0)
    for c in range(4):
        u = np.sin(0.2 * (c + 1) * t)
        for _ in range(2):
            hum = 0.5 * np.sin(2 * np.pi * 0.7 * t + draw.uniform(0, 6.28))
            records.append({"time_s": t, "u": u, "y": u + hum + 0.1 * draw.standard_normal(400), "condition": c})

    def simulate(record, theta):
        hum = theta.hum.amplitude * np.sin(2 * np.pi * theta.hum.f_Hz * record.time_s + theta.hum.phase)
        assert np.isfinite(hum).all()
        return theta.gain * record["u"] + hum

    amplitude = Parameter("amplitude", "", 0.3, 0.0, 3.0)
    hum = Effect("hum", (amplitude, frequency), frequency="f_Hz", own=phase)
    found = diagnose(lacuna.System(simulate, GAIN, hum, outputs="y"), records)
    assert [effect.name for effect in found.effects] == ["hum"]
    assert found.theta["hum.f_Hz"] == pytest.approx(0.7, abs=0.01)


def test_an_effect_with_its_absence_as_typical_size_begins_one_scale_away():
    t, records, draw = np.arange(0, 20, 0.1), [], np.random.default_rng(0)
    for c in range(4):
        u = (1 + 0.2 * c) * np.sin(0.3 * (c + 1) * t)
        noisy = ({"y": u + 0.3 * u**3 + 0.05 * draw.standard_normal(200)} for _ in range(3))
        records += [{"time_s": t, "u": u, "condition": c, **y} for y in noisy]
    powers = (2, 4, 5, 6, 7, 3)

    def simulate(record, theta):
        return theta.gain * record["u"] + sum(theta[f"power_{k}.by"] * record["u"] ** k for k in powers)

    effects = [Effect(f"power_{k}", Parameter("by", "", 0.1 * (k != 3), -3.0, 3.0)) for k in powers]
    found = diagnose(lacuna.System(simulate, GAIN, effects, outputs="y"), records)
    assert [effect.name for effect in found.effects] == ["power_3"]
    assert Effect("x", Parameter("by", "", 1.0, 0.0, 1.0), absent=1.0).parameters[0].value == pytest.approx(0.9)


@pytest.mark.parametrize("more", ["ok", None, np.zeros(3), object()], ids=["text", "none", "another length", "object"])
def test_a_simulation_may_return_more_than_the_outputs(more):
    t = np.arange(0, 20, 0.2)
    records = [{"time_s": t, "u": np.sin(k * t), "y": np.sin(k * t) + 0.01 * np.cos(9 * t)} for k in (0.3, 0.6, 0.9)]
    system = lacuna.System(
        lambda r, th: {"message": more, "y": th.gain * r["u"]},
        [GAIN, Parameter("unused", "", 1.0, 0.1, 5.0)],
        outputs="y",
    )
    assert diagnose(system, records).verdict


def test_advice_on_one_output_leaves_what_is_declared_for_another():
    system = lacuna.System(lambda r, th: {"y": r["u"], "z": r["u"]}, GAIN, noise_time_s={"y": 0.5})
    tried = system.with_noise_time({"z": 2.0})
    assert (tried.noise_time_s("", "y"), tried.noise_time_s("", "z")) == (0.5, 2.0)


def test_nothing_further_is_tried_once_a_search_was_stopped_by_hand():
    t, records, draw = np.arange(0, 40, 0.02), [], np.random.default_rng(1)
    for k in range(5):
        u = np.sin(0.1 * (k + 1) * t)
        records.append({"time_s": t, "u": u, "y": u**3 + 1e-4 * draw.standard_normal(2000)})
    system = lacuna.System(lambda r, th: th.gain * r["u"], GAIN, outputs="y")
    known, asked = with_records(system, records), []

    def again(raised):
        asked.append(raised)
        return found

    found = engine.diagnose(known)
    assert compare_at_misfit(known, found, again)[0] is found
    assert asked, "without a stop, the same is done again with a higher floor"
    asked.clear()
    stopped = replace(found, warnings=(STOPPED,))
    assert compare_at_misfit(known, stopped, again) == (stopped, {})
    assert not asked
