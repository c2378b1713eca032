"""Rules that are too small for a file of their own."""

import os
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import lacuna
from lacuna import Effect, Parameter
from lacuna.diagnosis.next_experiment import expected_gain, next_experiment
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.residual_error import Error, Floor
from lacuna.diagnosis.sizes import one_more, peaks, sized
from lacuna.diagnosis.warn import not_predicted
from lacuna.estimation.fit import fit
from lacuna.estimation.noise import ChannelNoise, NoiseFloor, estimate_noise
from lacuna.estimation.problem import usable_cores
from lacuna.estimation.structure import Structure
from lacuna.system import CandidateExperiment, Record


def test_all_cores_are_used_where_the_system_does_not_tell_which(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    assert usable_cores() == os.cpu_count()


def test_a_size_that_is_absent_at_one_is_tried_on_either_side_of_it():
    stretch = Effect("stretch", Parameter("factor", "", 1.2, 0.5, 2.0), absent=1.0)
    system = lacuna.System(lambda r, t: r.time_s, [Parameter("slope", "", 1.0, -5.0, 5.0)], [stretch])
    structure = Structure(system, ("stretch",))
    begun = sized(structure, structure.start(), "stretch", 1.0)
    told = [system.told("stretch.factor", structure.theta(values)["stretch.factor"]) for values in begun]
    assert told == pytest.approx([1.2, 0.8], rel=1e-12)


def test_an_experiment_never_run_is_weighed_by_what_its_channel_has_had_elsewhere():
    floor = NoiseFloor({("walk", "y"): ChannelNoise(2.0, 0.0, 1.0, 3), ("pull", "y"): ChannelNoise(1.0, 0.0, 1.0, 3)})
    a, b = {"y": np.zeros(10)}, {"y": np.full(10, 2.0)}

    def gain(experiment):
        trial = Record("next", experiment, "", np.arange(10.0), {"y": np.full(10, np.nan)})
        return expected_gain(a, b, CandidateExperiment(experiment, {}, trial), floor)

    assert gain("pull") == 20.0
    assert gain("step") == gain("walk") == 5.0


def test_an_experiment_that_a_rival_cannot_predict_is_not_proposed(monkeypatch):
    def simulate(record, theta):
        if theta.slope > 2.0:
            raise ValueError("beyond the end of the curve")
        return {"y": theta.slope * record.time_s}

    trial = Record("next", "run", "c", np.arange(9.0), {"y": np.full(9, np.nan)})
    system = lacuna.System(
        simulate, [Parameter("slope", "", 1.0, -5.0, 5.0)], experiments=[CandidateExperiment("run", {}, trial)]
    )
    floor = NoiseFloor({("run", "y"): ChannelNoise(1.0, 0.0, 1.0, 3)})
    rivals = [explanation(system, effects=(name,), slope=slope) for name, slope in (("a", 1.0), ("b", 3.0))]
    found = SimpleNamespace(with_effects=lambda effects: rivals[1], tried=rivals, floor=floor)
    monkeypatch.setattr("lacuna.diagnosis.next_experiment.dispersion_of", lambda tried: 1.0)
    choice = SimpleNamespace(candidate=rivals[0], confusable_with={"a": ("b",)})
    assert next_experiment(choice, found).experiment is None
    rivals[1].fitted.theta["slope"] = -1.0  # can be predicted
    assert next_experiment(choice, found).experiment == "run"


def explanation(system, effects, **theta):
    return SimpleNamespace(
        effects=effects, fitted=SimpleNamespace(theta=theta, structure=SimpleNamespace(system=system))
    )


def test_a_frequency_that_no_record_resolves_begins_at_its_typical_value():
    """Records sampled at 10 Hz show no peak at 50 Hz; without a start there, the effect would never be tried."""
    sizes = (Parameter("size", "", 0.3, 0.0, 5.0), Parameter("f_Hz", "Hz", 50.3, 20.0, 100.0))
    hum = Effect("hum", sizes, frequency="f_Hz")
    time_s = np.arange(0.0, 10.0, 0.1)
    trials = tuple(Record(f"{k}", "run", "c", time_s, {"y": np.sin(time_s + 0.01 * k)}) for k in range(4))

    def simulate(record, theta):
        at = 2.0 * np.pi * theta.hum.f_Hz * record.time_s
        return {"y": theta.slope * np.sin(record.time_s) + theta.hum.size * np.sin(at)}

    system = lacuna.System(simulate, [Parameter("slope", "", 1.0, -5.0, 5.0)], hum).with_trials(trials)
    parent = fit(Structure(system), trials, estimate_noise(system, trials))
    problem, begun, _ = one_more(parent, "hum")
    assert {problem.structure.theta(values)["hum.f_Hz"] for values in begun} == {50.3}


def test_what_a_trial_has_of_its_own_may_lie_anywhere_if_nothing_is_said_of_its_spread():
    phase = Parameter("phase_rad", "rad", 0.0, 0.0, 8.0)
    trial = Record("1", "run", "c", np.arange(9.0), {"y": np.arange(9.0)})
    for own, scale in ((phase, 2.0), (replace(phase, scale=0.1), 0.1)):
        hum = Effect("hum", Parameter("size", "", 0.3, 0.0, 5.0), own=own)
        system = lacuna.System(lambda r, t: r.time_s, Parameter("slope", "", 1.0, -5.0, 5.0), hum)
        (found,) = Structure(system, ("hum",)).own(trial)
        assert found.step_scale == scale


@pytest.mark.parametrize(("duration_s", "line_hz"), [(0.05, 7300.0), (6.0, 7.3), (54.0, 0.61), (2000.0, 0.0123)])
def test_a_line_is_among_the_peaks_of_the_residual_whatever_the_records_duration(duration_s, line_hz):
    draw, time_s = np.random.default_rng(3), np.linspace(0.0, duration_s, 1500, endpoint=False)
    lines = (2.0 * np.sin(2.0 * np.pi * (line_hz * time_s + draw.random())) for _ in range(8))
    scaled = [{"y": draw.standard_normal(1500) + line} for line in lines]
    trials = [Record(f"{k}", "run", "c", time_s, one) for k, one in enumerate(scaled)]
    found = peaks(trials, scaled, line_hz / 7.0, 4.0 * line_hz, 3)
    assert min(abs(hz - line_hz) for hz in found) < 0.5 / duration_s


def test_a_range_far_wider_than_records_resolve_is_searched_coarsely():
    """A range of 100 kHz in records of 2000 s must not need more cells than fit in memory."""
    time_s = np.linspace(0.0, 2000.0, 1500, endpoint=False)
    scaled = [{"y": np.sin(2.0 * np.pi * 0.3 * time_s)}]
    trials = [Record("1", "run", "c", time_s, scaled[0])]
    assert len(peaks(trials, scaled, 0.001, 1e5, 3)) <= 3


@pytest.mark.parametrize(("error", "repeats", "said"), [(1.4, 1.0, True), (1.0, 1.0, False), (0.12, 0.01, False)])
def test_only_errors_of_the_size_of_the_noise_are_worse_than_it(error, repeats, said):
    """Repeats that differ by a hundredth of the declared noise do not make a tenth of it an error to warn of."""
    final = (Record("a", "run", "a", np.arange(400.0), {"y": np.zeros(400)}),)
    floor = NoiseFloor({("run", "y"): ChannelNoise(1.0, 0.0, 1.0, 3)})
    found, split = SimpleNamespace(problem=SimpleNamespace(floor=floor)), SimpleNamespace(final=final)
    warned = not_predicted(found, split, Error(1.0, error, error, {}), Floor(1.0, repeats, repeats), POLICY)
    assert bool(warned) is said
