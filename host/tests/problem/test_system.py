"""The robot as a system of the engine: predictions, what matters where, nuisances, candidates, corrections."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from bifa.data import Dataset, DatasetError, Trial
from bifa.identify.start import prepare
from bifa.measure.plan import EXTENDED
from bifa.problem.inputs import Averaging, inputs_of
from bifa.problem.stiffness import UndeterminedError
from bifa.problem.system import RobotSystem, engine_effects
from bifa.robot import ModelParameterError, nominal
from bifa.robot.learnt import LearntCurve
from bifa.simulate import static_loading, step_response, timeline
from lacuna.estimation.fit import spread_starts
from lacuna.estimation.graduated import solve_graduated
from lacuna.estimation.noise import estimate_noise
from lacuna.estimation.problem import Problem
from lacuna.estimation.structure import Structure
from lacuna.system import Correction


def test_trials_side_by_side_are_predicted_as_each_alone(system, theta):
    """Walks of several lengths and slopes share a kernel's lanes, also with one that cannot be simulated."""
    walk = next(t for t in system.trials if t.experiment == "locomotion")
    short = replace(walk.payload, time_s=walk.time_s[: len(walk.time_s) // 2], inclination_deg=4.0)
    half = {c: v[: len(short.time_s)] for c, v in walk.channels.items()}
    shorter = replace(walk, name="shorter", time_s=short.time_s, channels=half, payload=short)
    overhanging = replace(walk, payload=replace(walk.payload, inclination_deg=100.0))
    trials = [*system.trials, shorter, walk, overhanging]
    found = system.predict_trials([theta] * len(trials), (), trials)
    assert np.isnan(next(iter(found[-1].values()))).all()
    for trial, channels in zip(trials[:-1], found[:-1], strict=True):
        alone = system.predict(theta, (), trial)
        for name, expected in alone.items():
            np.testing.assert_allclose(channels[name], expected, atol=2e-3 * np.ptp(expected) + 1e-9, err_msg=name)


def test_pressures_are_means_over_the_time_for_which_the_uno_averages(system, theta):
    """24 conversions of 104 us. During a snap against the wall the instantaneous pressure is another."""
    walk = next(t for t in system.trials if t.experiment == "locomotion")

    def seen(late_s, averaged_s=0.0):
        payload = replace(walk.payload, time_s=walk.payload.time_s + late_s, averaged_s=averaged_s)
        return system.predict(theta, (), replace(walk, payload=payload))

    off, off_at_once = [], []
    for late_s in np.arange(0.002, 0.012, 0.001):
        each = [seen(late_s + 104e-6 * (k - 11.5)) for k in range(24)]
        averaged, at_once = seen(late_s, averaged_s=0.0025), seen(late_s)
        for name in ("pressure_head_psi", "pressure_tail_psi"):
            mean = np.mean([columns[name] for columns in each], axis=0)
            off.append(averaged[name] - mean)
            off_at_once.append(at_once[name] - mean)
    assert np.std(off) < 0.4 * np.std(off_at_once)


def test_statics_alone_give_the_areas(system, theta, lab):
    assert theta["body_area_N_psi"] == pytest.approx(lab.large.area, rel=0.002)
    assert theta["small_area_N_psi"] == pytest.approx(lab.small.area, rel=0.002)
    assert set(system.fitted).isdisjoint({"head_mass_kg", "supply_positive_psi"})  # the lab knows them


@pytest.mark.parametrize("seed", range(2))
def test_a_fit_finds_the_robot_from_anywhere_plausible(system, lab, seed):
    structure = Structure(system)
    problem = Problem(structure, system.trials, estimate_noise(system, system.trials))
    _, start = spread_starts(structure, structure.start(), 2, seed)
    found = structure.theta(solve_graduated(problem, start, max_iterations=20, relative=1e-3).point.values)
    for name in lab.truth.keys() - {"body_area_N_psi", "small_area_N_psi", "mu_s"}:
        tolerance = 0.05 if name in ("small_damping_Ns_m", "mu_k") else 0.02
        assert found[name] == pytest.approx(lab.truth[name], rel=tolerance), name


def test_predictions_and_regressors_have_a_value_for_every_sample(system, theta):
    for trial in system.trials:
        prediction = system.predict(theta, (), trial)
        assert prediction.keys() == trial.channels.keys()
        regressors = system.regressors(trial, prediction)
        assert {"time", "place in the session"} <= regressors.keys()
        for name, values in (*prediction.items(), *regressors.items()):
            assert values.shape == trial.time_s.shape, name
            assert np.isfinite(values).all(), name


def test_what_travelled_to_another_process_predicts_the_same(system, theta):
    traveled = pickle.loads(pickle.dumps(system))
    for trial, arrived in zip(system.trials, traveled.trials, strict=True):
        there = traveled.predict(theta, ("hysteresis",), arrived)
        for channel, values in system.predict(theta, ("hysteresis",), trial).items():
            assert np.array_equal(values, there[channel])


def test_a_prediction_never_looks_at_what_was_measured(dataset, system, theta):
    """Predictions stay the same if the outputs are replaced by rubbish."""
    outputs = ("force_N", "pressure", "displacement_head", "displacement_tail")
    for trial, recorded in zip(system.trials, dataset.trials, strict=True):
        hidden = (*outputs, "displacement_mm") if trial.experiment == "step_response" else outputs
        rubbish = {name: 0.0 * values for name, values in recorded.columns.items() if name.startswith(hidden)}
        blind = replace(trial, payload=inputs_of(replace(recorded, columns=recorded.columns | rubbish)))
        for channel, values in system.predict(theta, (), trial).items():
            assert np.array_equal(values, system.predict(theta, (), blind)[channel])


def test_what_is_said_not_to_matter_does_not(system, theta):
    for trial in system.trials:
        reference = system.predict(theta, (), trial)
        for parameter in system.parameters:
            if "_shape_" in parameter.name or system.matters(parameter.name, trial):
                continue
            moved = theta | {parameter.name: parameter.value + 0.01 * parameter.step_scale}
            for channel, values in system.predict(moved, (), trial).items():
                assert np.allclose(values, reference[channel], atol=1e-6), (parameter.name, trial.name)


def test_mu_s_can_be_found_by_derivatives(system, theta):
    """The peak of a pull lies between samples; a prediction that jumped there would have no slope."""
    pull = next(t for t in system.trials if t.experiment == "anchor_pull" and t.payload.pressure_psi > 0)
    slopes = []
    for mu_s in np.linspace(0.44, 0.52, 41):
        force = [system.predict(theta | {"mu_s": mu_s + d}, (), pull)["force_N"] for d in (-1e-4, 1e-4)]
        slopes.append(np.abs(force[1] - force[0]).sum())
    assert min(slopes) > 0.0


@pytest.mark.parametrize("effect", sorted(engine_effects()))
def test_effects_act_where_they_are_said_to(system, theta, effect):
    active = theta | {f"{effect}.{p.name}": p.value for p in system.effects[effect].parameters}
    shows = []
    for trial in system.trials:
        without, with_ = system.predict(theta, (), trial), system.predict(active, (effect,), trial)
        if trial.experiment in system.effects[effect].experiments:
            shows.append(any(not np.allclose(with_[c], without[c]) for c in without))
        else:  # mm, N or psi: a tenth of the noise
            assert max(np.abs(with_[c] - without[c]).max() for c in without) < 1e-2, trial.name
    assert any(shows)


def test_repeats_share_a_condition_and_friction_may_wobble(system):
    nuisances = {t.experiment: [p.name for p in system.nuisances(t)] for t in system.trials}
    assert nuisances["static_loading"] == []
    assert nuisances["step_response"] == ["switch_late_s"], "only the command column shows it, to a sample"
    assert nuisances["locomotion"] == ["friction_scale"]
    assert nuisances["anchor_pull"] == ["friction_scale", "slip_late_s"]


def test_candidates_can_be_predicted(system, theta):
    candidates = {c.experiment: c.trial for c in system.candidate_experiments()}
    assert candidates.keys() == {"static_loading", "step_response", "anchor_pull", "locomotion"}
    for candidate in system.candidate_experiments():
        assert all(np.isnan(values).all() for values in candidate.trial.channels.values())
    assert all(np.isfinite(v).all() for v in system.predict(theta, (), candidates["anchor_pull"]).values())


def test_the_head_of_a_candidate_pull_is_extended_as_that_of_a_recorded_one(system, theta):
    """With play in the spring this changes its holding force: the experiment that tells backlash from hysteresis."""
    pulls = [c.trial for c in system.candidate_experiments() if c.experiment == "anchor_pull"]
    assert {pull.payload.extended_psi for pull in pulls} == set(EXTENDED.values())
    vented = next(pull for pull in pulls if pull.payload.pressure_psi == 0.0)
    never = replace(vented, payload=replace(vented.payload, extended_psi=0.0))
    with_play = theta | {"backlash.gap_m": 0.0012}
    once, not_once = (system.predict(with_play, ("backlash",), pull)["force_N"] for pull in (vented, never))
    assert abs(once.max() - not_once.max()) > 1.0


def test_a_learnt_spring_adds_its_force(system, theta):
    trial = system.trials[0]
    site = system.correction_sites["body_spring"]
    constant = Correction(site.name, np.full((1, 33), 2.5))
    plain, more = (system.predict(theta, (), trial, corrections=c)["force_N"] for c in ((), (constant,)))
    assert more - plain == pytest.approx(2.5, abs=1e-9)


def test_the_identified_model_predicts_what_the_system_does(system, theta):
    model = system.model_at(theta)
    trial = system.trials[0]
    inputs = trial.payload
    path = (inputs.displacement_m - model.body_stiffness.contracted_m) * 1e3
    record = static_loading(model, "large", inputs.time_s, path, inputs.pressure_psi)
    assert record["force_N"] == pytest.approx(system.predict(theta, (), trial)["force_N"], abs=1e-9)


def test_a_model_at_a_fit_has_only_what_was_fitted(dataset, system, theta):
    """A learnt curve of the initial model was once written back as if it had been fitted."""
    curve = LearntCurve(-0.8, 0.8, np.full((1, 9), 30.0))
    bent = RobotSystem(dataset, replace(system.model, learnt={"body_damper": curve}), system.curves, system.fitted)
    assert not bent.model_at(theta).learnt


def test_what_remembers_travel_sees_a_turn_between_samples(dataset, system, theta):
    recorded, effect = dataset.trials[0], engine_effects()["hysteresis"]
    loaded = theta | {effect.full_name(p): p.value for p in effect.parameters}
    low_mm, half_s = recorded.columns["displacement_mm"].min(), 5.51  # it turns midway between two samples

    def force(rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
        time_s = np.arange(0.0, 2.0 * half_s, 1.0 / rate_hz)
        path_mm = low_mm + 8.0 * np.minimum(time_s, 2.0 * half_s - time_s)
        trial = replace(recorded, columns={"time_s": time_s, "displacement_mm": path_mm, "force_N": 0.0 * time_s})
        record = replace(system.trials[0], time_s=time_s, channels={"force_N": 0.0 * time_s}, payload=inputs_of(trial))
        return time_s, system.predict(loaded, ("hysteresis",), record)["force_N"]

    coarse_s, coarse = force(50.0)
    assert coarse == pytest.approx(np.interp(coarse_s, *force(10_000.0)), abs=0.01)


def highest_psi(dataset, gauge_psi, **walk):
    """Highest predicted pressure of the body in a walk, for a lab whose gauge reads `gauge_psi`."""
    statics, (walked,) = dataset.of("static_loading"), dataset.of("locomotion")
    trials = (*statics, replace(walked, **{"extra": {"set_point_psi": 8.4741}} | walk))
    system = prepare(replace(dataset, known={"supply_positive_psi": gauge_psi}, trials=trials))
    predicted = system.predict({p.name: p.value for p in system.parameters}, (), system.trials[-1])
    return predicted["pressure_body_psi"].max()


def test_the_gauge_counts_and_not_the_set_point(dataset):
    told = [highest_psi(dataset, gauge_psi) for gauge_psi in (8.0, 9.0)]
    assert told == pytest.approx([8.0, 9.0], abs=0.15)


def test_a_walk_at_a_pressure_of_its_own_has_its_set_point(dataset):
    told = highest_psi(dataset, 9.0, pressure_psi=6.5, extra={"set_point_psi": 6.49})
    assert told == pytest.approx(6.49, abs=0.15)


def test_an_empty_data_set_is_refused():
    with pytest.raises(UndeterminedError, match="no trials"):
        prepare(Dataset(path=None, name="empty", known={}, trials=()))


@pytest.mark.parametrize(
    ("experiment", "column", "instrument"),
    [
        ("static_loading", "force_N", "load cell"),
        ("anchor_pull", "force_N", "load cell"),
        ("anchor_pull", "displacement_mm", "cross-head"),
    ],
)
def test_a_dead_channel_of_the_testing_machine_is_named_with_its_file(dataset, experiment, column, instrument):
    dead = dataset.of(experiment)[0]
    silent = replace(dead, columns={**dead.columns, column: np.zeros_like(dead.columns[column])})
    trials = tuple(silent if trial is dead else trial for trial in dataset.trials)
    with pytest.raises(DatasetError, match=rf"{dead.file}, column {column}: every sample reads 0: is the {instrument}"):
        prepare(replace(dataset, trials=trials))


def test_a_pull_may_be_held_for_longer_than_it_lasts(dataset):
    pull = dataset.of("anchor_pull")[0]
    held, sample_s = len(pull.time_s) + 10, float(np.median(np.diff(pull.time_s)))
    columns = {name: np.append(values, np.full(held, values[-1])) for name, values in pull.columns.items()}
    columns["time_s"][-held:] += sample_s * np.arange(1, held + 1)
    assert inputs_of(replace(pull, columns=columns)).sample_s == pytest.approx(sample_s, rel=0.1)


def test_knowledge_of_what_the_model_does_not_have_is_refused(dataset):
    with pytest.raises(ModelParameterError, match="colour"):
        prepare(replace(dataset, known=dataset.known | {"colour": 3.0}))


def test_a_model_with_effects_or_learnt_curves_is_no_base_model(dataset):
    """A completed model is refused as a base model; its effects and curves were once left out silently."""
    curve = LearntCurve(-0.8, 0.8, np.zeros((1, 9)))
    completed = replace(nominal().with_effects({"choked_flow": {}}), learnt={"body_damper": curve})
    with pytest.raises(ModelParameterError, match=r"\[effects.choked_flow\], \[learnt.body_damper\].* base model"):
        prepare(dataset, completed)


def test_without_static_loadings_displacements_count_from_the_contracted_state():
    time_s, schedule = np.arange(600) / 100.0, timeline([(0.0, 0, 0), (0.5, 0, 1), (3.0, 0, 0)])
    measured = step_response(nominal(), "large", time_s, schedule)
    columns = {**measured.columns, "command": ((time_s >= 0.5) & (time_s < 3.0)).astype(float)}
    known, extra = {"supply_negative_psi": -13.0}, {"switch_time_s": [0.5, 3.0]}
    step = Trial("s.csv", "step_response", columns, actuator="large", pressure_psi=8.5, extra=extra)
    system = prepare(Dataset(None, "a step alone", known, (step,), {}))
    found = system.predict({p.name: p.value for p in system.parameters}, (), system.trials[0])
    np.testing.assert_allclose(found["displacement_mm"], measured["displacement_mm"], atol=0.05)


def test_means_over_more_than_a_sample_are_simulated_in_order():
    time_s = np.arange(1, 400) / 200.0
    means = Averaging(time_s, 0.01)
    assert (np.diff(means.simulated_s) >= 0.0).all()
    np.testing.assert_allclose(means.means({"clock": means.simulated_s})["clock"], time_s)


@pytest.mark.parametrize("change", [lambda force_N: -force_N, lambda force_N: force_N + 100.0])
def test_a_curve_without_two_stable_states_is_refused(dataset, change):
    trials = [t for t in dataset.of("static_loading", "large") if t.pressure_psi == 0.0]
    upset = tuple(replace(t, columns={**t.columns, "force_N": change(t.columns["force_N"])}) for t in trials)
    with pytest.raises(UndeterminedError, match=r"of the large actuator at 0 psi, from .* no two stable states"):
        prepare(replace(dataset, trials=upset))
