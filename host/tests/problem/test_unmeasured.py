"""Unmeasured parameters have priors, declared ones are known, and spare conditions lie between fitted ones."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.identify.start import prepare
from bifa.problem.accuracy import AccuracyError, accuracies, accuracy_of
from bifa.problem.system import spare
from bifa.problem.unmeasured import LOAD_CELL, PRIOR_SD, STAND_MASS
from harness.independent_lab import BASELINE

GAITS = [BASELINE | {"period_s": period} for period in (5.7, 4.4, 3.4)]


@pytest.fixture(scope="module")
def system(dataset):
    return prepare(replace(dataset, known={"head_mass_kg": 0.175}))


def named(system):
    return {p.name: p for p in system.parameters}


def test_what_is_declared_is_known_and_what_is_not_has_a_prior(system):
    found = named(system)
    assert "head_mass_kg" not in found
    for name in set(PRIOR_SD) - {"head_mass_kg"}:
        assert found[name].prior_sd == PRIOR_SD[name]
    assert found[STAND_MASS].prior_sd
    assert found[LOAD_CELL].prior_sd


def test_the_mass_on_the_stand_moves_the_steps_of_the_large_actuator_only(system):
    theta = {p.name: p.value for p in system.parameters}
    for trial in system.trials:
        before = system.predict(theta, (), trial)
        after = system.predict(theta | {STAND_MASS: 0.05}, (), trial)
        moved = any(not np.array_equal(before[c], after[c]) for c in before)
        assert moved == (trial.experiment == "step_response" and trial.payload.actuator == "large"), trial.name
        assert moved == system.matters(STAND_MASS, trial)


def test_a_load_cell_that_the_data_set_declares_is_known(dataset):
    declared = tuple(replace(t, extra={**t.extra, LOAD_CELL: 6200.0}) for t in dataset.trials)
    assert LOAD_CELL not in named(prepare(replace(dataset, known={}, trials=declared)))


def test_never_fitted_are_a_middle_pressure_a_middle_gait_and_the_lower_of_two_steps(dataset):
    made = [replace(dataset.of("static_loading")[0], pressure_psi=p) for p in (0.0, 4.0, 8.5)]
    made += [replace(dataset.of("step_response")[0], pressure_psi=p) for p in (6.0, 8.5)]
    made += [replace(dataset.of("anchor_pull")[0], pressure_psi=p) for p in (0.0, 8.5)]
    made += [replace(dataset.of("locomotion")[0], gait=gait) for gait in GAITS]
    chosen = set(spare(replace(dataset, trials=tuple(made))))
    spared = [t for t in made if (t.experiment, t.condition) in chosen]
    assert [t.pressure_psi for t in spared if t.experiment == "static_loading"] == [4.0]
    assert [t.pressure_psi for t in spared if t.experiment == "step_response"] == [6.0]
    assert not [t for t in spared if t.experiment == "anchor_pull"], "of two pressures both are needed"
    assert [t.gait["period_s"] for t in spared if t.experiment == "locomotion"] == [4.4]


def test_accuracies_are_read_from_texts_and_hold_for_every_channel_of_the_quantity():
    asked = accuracies(["displacement_mm=0.5", "force_N=2"])
    assert accuracy_of("displacement_head_mm", asked) == 0.5
    assert accuracy_of("force_N", asked) == 2.0
    assert accuracy_of("pressure_body_psi", asked) == 0.0


@pytest.mark.parametrize("text", ["displacement_mm", "displacement_mm=", "force_N=-1", "force_N=nan", "speed=1"])
def test_an_accuracy_that_is_none_is_refused_with_what_there_is(text):
    with pytest.raises(AccuracyError, match="displacement_mm, pressure_psi, force_N"):
        accuracies([text])
