"""Rules that are too small for a file of their own."""

import os

import numpy as np

import lacuna
from lacuna import Effect, Parameter
from lacuna.cores import usable_cores
from lacuna.diagnosis.next_experiment import expected_gain
from lacuna.diagnosis.sizes import sized
from lacuna.estimation.autocorrelation import correlation_samples
from lacuna.estimation.noise import ChannelNoise, NoiseFloor
from lacuna.estimation.structure import Structure
from lacuna.system import CandidateExperiment, Record


def test_all_cores_are_used_where_the_system_does_not_tell_which(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    assert usable_cores() == os.cpu_count()


def test_a_size_that_is_absent_at_one_is_tried_on_either_side_of_it():
    stretch = Effect("stretch", Parameter("factor", "", 1.2, 0.5, 2.0), absent=1.0)
    system = lacuna.System(lambda r, t: r.time_s, [Parameter("slope", "", 1.0, -5.0, 5.0)], [stretch])
    structure = Structure(system, ("stretch",))
    told = [
        system.told("stretch.factor", v[structure.names.index("stretch.factor")])
        for v in sized(structure, structure.start(), "stretch", 1.0)
    ]
    np.testing.assert_allclose(told, [1.2, 0.8], rtol=1e-12)


def test_an_experiment_never_run_is_weighed_by_what_its_channel_has_had_elsewhere():
    floor = NoiseFloor({("walk", "y"): ChannelNoise(2.0, 0.0, 1.0, 3), ("pull", "y"): ChannelNoise(1.0, 0.0, 1.0, 3)})
    a, b = {"y": np.zeros(10)}, {"y": np.full(10, 2.0)}

    def gain(experiment):
        trial = Record("next", experiment, "", np.arange(10.0), {"y": np.full(10, np.nan)})
        return expected_gain(a, b, CandidateExperiment(experiment, {}, trial), floor)

    assert gain("pull") == 20.0
    assert gain("step") == gain("walk") == 5.0


def test_missing_samples_are_no_neighbours():
    draw = np.random.default_rng(0)
    noise = draw.standard_normal(4000)
    smooth = np.convolve(noise, np.ones(5) / 5, mode="same")
    sparse = np.full(len(smooth) * 4, np.nan)
    sparse[::4] = smooth
    assert correlation_samples([sparse]) == correlation_samples([smooth]) > 4.0
