"""Repeats that are not repeats, and the warnings about them before a search."""

import heater
import numpy as np
import pytest
from heater import said_of

import lacuna
from lacuna import Effect, Parameter
from lacuna.errors import MisuseError
from lacuna.estimation.noise import estimate_noise
from lacuna.run import with_records

MISTAKES = {
    "spiked": lambda temperature_K: np.where(np.arange(240) == 77, 85.0, temperature_K),
    "in another unit": lambda temperature_K: 1e3 * temperature_K,
    "switched off": np.zeros_like,  # constant, which no channel may be in every trial
}


@pytest.mark.parametrize("mistake", MISTAKES)
@pytest.mark.parametrize("which", ["steps_4W_1", "steps_4W_2", "steps_4W_3"])
def test_one_that_is_unlike_all_others_is_pointed_out(mistake, which):
    records = heater.records(3)
    records[which]["temperature_K"] = MISTAKES[mistake](records[which]["temperature_K"])
    (said,) = said_of(records)
    assert said.startswith(f"Trial {which}, channel temperature_K: differs from its repeats")
    assert "leave it out" in said
    if mistake == "spiked":
        assert f"most at {heater.TIME_S[77]:g} s" in said


def test_of_two_it_is_said_that_they_differ():
    records = heater.records(2)
    records["steps_4W_1"]["temperature_K"][77] = 85.0
    (said,) = said_of(records)
    assert said.startswith("Trials steps_4W_1 and steps_4W_2, repeats of one condition, differ in temperature_K by")


@pytest.mark.parametrize("repeats", [2, 3, 5])
@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_said_of_repeats_that_differ_as_repeats_do(repeats, seed):
    assert not said_of(heater.records(repeats, seed=seed, sensor_lag__lag_s=3.0))


def test_a_copy_is_no_repeat():
    records = heater.records(2)
    records["steps_4W_2"]["temperature_K"] = records["steps_4W_1"]["temperature_K"].copy()
    (said,) = said_of(records)
    assert said == "Trials steps_4W_1 and steps_4W_2 are identical: a copy is not a repeat. Leave one out."


def test_repeats_that_are_not_declared_are_asked_for():
    records = heater.records(2)
    for name, record in records.items():
        record["condition"] = name
    (said,) = said_of(records)
    assert said.startswith("Trials steps_4W_1 and steps_4W_2 have the same inputs, but no repeats are declared")
    assert not said_of({name: record for name, record in records.items() if name.endswith("_1")})


def test_segments_of_one_run_are_not_taken_for_repeats():
    run = heater.records(1)["steps_4W_1"] | {"power_W": np.ones(240)}
    assert not any("same inputs" in said for said in said_of(lacuna.segments(run, 4)))


def test_an_input_may_differ_if_the_base_model_does_not_use_it():
    draw = np.random.default_rng(0)
    records = {n: r | {"room_C": 21.0 + 0.1 * draw.standard_normal(240)} for n, r in heater.records(3).items()}
    (said,) = said_of(records)
    assert "have a different room_C, which the base model does not use" in said


def test_a_column_with_fewer_values_than_there_are_times_is_refused():
    records = heater.records(2)
    records["steps_4W_2"]["power_W"] = records["steps_4W_2"]["power_W"][:-20]
    with pytest.raises(MisuseError, match="steps_4W_2, input power_W: 220 values, but there are 240 times"):
        said_of(records)


@pytest.mark.parametrize("other", [True, False])
def test_a_model_that_counts_samples_is_pointed_out_where_repeats_have_other_times(other):
    """A model that counts samples, as the heater's, takes half of the samples for half of the time."""
    records = heater.records(3)
    for name in (name for name in records if other and name.endswith("_2")):
        records[name] |= {column: records[name][column][::2] for column in ("time_s", "power_W", "temperature_K")}
    verdict = lacuna.diagnose(heater.system(), records, progress=False)
    assert any("does the model count samples" in said for said in verdict.warnings) == other


def response(seed, relative, saturates, unit=1.0):
    """A dose-response table: three repeats of three series of doses."""
    draw, records = np.random.default_rng(seed), {}
    for series in (1.0, 1.5, 2.0):
        dose = series * np.linspace(0.5, 50.0, 14)
        for k in range(3):
            y = 2.0 * dose / (1.0 + saturates * dose)
            y = y * (1.0 + relative * draw.standard_normal(14)) + 0.05 * draw.standard_normal(14)
            given = {"time_s": np.arange(14.0), "dose": dose, "y": unit * y, "condition": series}
            records[f"{series}, run {k}"] = given
    return records


def dose_response(unit=1.0):
    def simulate(record, theta):
        dose = record["dose"]
        return {"y": unit * (theta.slope * dose / (1.0 + theta.saturation.per_dose * dose) + theta.zero.offset)}

    effects = [
        Effect("saturation", Parameter("per_dose", "", 0.0, 0.0, 1.0, scale=0.01)),
        Effect("zero", Parameter("offset", "", 0.0, -50.0, 50.0, scale=0.5)),
    ]
    return lacuna.System(simulate, Parameter("slope", "", 1.5, 0.1, 10.0), effects)


@pytest.mark.parametrize("seed", [9, 10, 11])
def test_noise_that_grows_with_the_reading_is_no_structure(seed):
    found = lacuna.diagnose(dose_response(), response(seed, 0.05, 0.0), progress=False)
    assert found.verdict == "none"
    assert found.diagnosis.search.floor.channels["run", "y"].grows


@pytest.mark.parametrize("relative", [0.0, 0.05])
def test_an_effect_is_found_whether_or_not_noise_grows_with_the_reading(relative):
    found = lacuna.diagnose(dose_response(), response(2, relative, 0.01), progress=False)
    assert [e.name for e in found.effects] == ["saturation"]
    assert found.effects[0].parameters["per_dose"] == pytest.approx(0.01, rel=0.2)


@pytest.mark.parametrize("unit", [1.0, 1e-14, 1e14])
@pytest.mark.parametrize("seed", range(4))
def test_the_floor_tells_noise_that_grows_from_noise_that_does_not(seed, unit):
    one, readings = dose_response(unit), unit * np.array([0.0, 10.0, 100.0])
    for relative in (0.0, 0.05):
        trials = with_records(one, response(seed, relative, 0.0, unit)).trials
        noise = estimate_noise(one, trials).channels["run", "y"]
        if not relative:
            assert not noise.grows
            continue
        assert noise.sd_at(readings)[1:] / readings[1:] == pytest.approx(0.05, rel=0.2)
        assert 0.0 < noise.sd_at(readings)[0] < 0.2 * unit


@pytest.mark.parametrize(("bend", "verdict"), [(4e-4, "identified"), (0.0, "none")])
@pytest.mark.parametrize("spread", [0.2, 5.0])
def test_runs_that_differ_by_more_than_the_noise_do_not_hide_what_is_missing(spread, bend, verdict):
    """Each run has an offset of up to a hundred times the noise, which must not remain in the noise floor."""
    time_s, draw = np.arange(0.0, 10.0, 0.05), np.random.default_rng(1)

    def simulate(record, theta):
        pushed = record["level"] * time_s
        return {"y": theta.gain * pushed + theta.offset + theta.bend.by * pushed**2}

    def measured(level):
        clean = level * time_s + bend * (level * time_s) ** 2
        return clean + spread * draw.standard_normal() + 0.05 * draw.standard_normal(len(time_s))

    records = {
        f"{level}_{k}": {"time_s": time_s, "level": float(level), "condition": level, "y": measured(level)}
        for level in (1, 2, 3, 4)
        for k in range(3)
    }
    effect = Effect("bend", Parameter("by", "", 0.001, -0.1, 0.1))
    offset = Parameter("offset", "", 0.0, -20.0, 20.0, scale=spread)
    system = lacuna.System(simulate, Parameter("gain", "", 0.8, 0.0, 5.0), effect, nuisances=offset)
    found = lacuna.diagnose(system, records, progress=False)
    assert found.verdict == verdict
    if verdict == "identified":
        assert found.diagnosis.search.floor.channels["run", "y"].sd == pytest.approx(0.05, rel=0.1)
        assert {name for own in found.nuisances.values() for name in own} == {"offset"}
        assert np.std([own["offset"] for own in found.nuisances.values()]) > 0.5 * spread


@pytest.mark.parametrize("samples", [200, 90])
def test_a_repeat_that_ended_sooner_is_a_repeat(samples):
    records = heater.records(2)
    for record in list(records.values())[1::2]:
        record.update({name: record[name][:samples] for name in ("time_s", "power_W", "temperature_K")})
    assert not said_of(records)


def test_an_input_of_several_columns_is_compared_between_repeats():
    def simulate(record, theta):
        return heater.bare({"power_W": record["heaters_W"].sum(axis=1)}, theta)

    records = heater.records(2)
    for record in records.values():
        record["heaters_W"] = np.stack([record.pop("power_W"), np.zeros(len(heater.TIME_S))], axis=1)
    assert not said_of(records, heater.modelled(simulate))
    records["steps_4W_2"]["heaters_W"][:, 1] = 2.0
    with pytest.raises(MisuseError, match=r"steps_4W_1 and steps_4W_2 are declared as repeats.*heaters_W differs"):
        said_of(records, heater.modelled(simulate))


@pytest.mark.parametrize("missing", [slice(0, None, 2), slice(0, 120)])
def test_repeats_without_a_sample_in_common_still_show_what_is_missing(missing):
    """One repeat lacks the samples that the other has, so that their differences give no floor."""
    records = heater.records(2, sensor_lag__lag_s=3.0)
    for place, record in enumerate(records.values()):
        lacking = np.zeros(len(heater.TIME_S), bool)
        lacking[missing] = True
        record["temperature_K"][lacking == bool(place % 2)] = np.nan
    found = lacuna.diagnose(heater.system(), records, progress=False)
    assert [effect.name for effect in found.effects] == ["sensor_lag"]


def test_a_floor_from_repeats_is_not_doubted_for_want_of_repeats():
    found = lacuna.diagnose(heater.modelled(heater.bare), heater.records(2, offset__power_W=3.0), progress=False)
    (said,) = [warning for warning in found.warnings if "No explanation comes near" in warning]
    assert "a repeat would tell" not in said
