"""What owes nothing to the fits before it: begun at the initial guess, judged from a distance."""

from dataclasses import replace

import numpy as np
import pytest
from toy import ToySystem, hide

from lacuna.diagnosis.anew import Anew
from lacuna.diagnosis.candidate import Candidate, from_initial_guess, judge, profiles, sketches
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.crew import Crew
from lacuna.diagnosis.from_afar import begin as begin_from_afar
from lacuna.diagnosis.from_afar import follow as follow_from_afar
from lacuna.diagnosis.from_afar import promising
from lacuna.diagnosis.learn import learn_correction
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.split import split_trials
from lacuna.estimation.fit import Fit, evaluate_on
from lacuna.estimation.problem import Problem
from lacuna.estimation.solve import cost_of
from lacuna.estimation.structure import Structure

NOBODY = Crew(lambda _: None)  # says nothing, and forks nothing


class Tangled(ToySystem):
    """Every trial shows all parameters together."""

    def isolates(self, trial):
        return False


class Bench(ToySystem):
    """Steps isolate parameters; sweeps show all together."""

    def isolates(self, trial):
        return trial.experiment == "steps"


class DragsInSweeps(Bench):
    """Drag that steps do not show."""

    def predict(self, theta, effects, trial, **how):
        known = theta if trial.experiment == "sweep" else {**theta, "quadratic_drag.drag_Ns2_m2": 0.0}
        return super().predict(known, effects, trial, **how)


def bench(effects, seed) -> Case:
    hidden = hide(effects, seed=seed)
    system = Bench(hidden.trials, hidden.effects)
    return Case(system, split_trials(system.trials, system.spare()), POLICY, 0)


def lost(case: Case, effects=()) -> Candidate:
    """A fit of these effects that is nowhere near, and continues from nothing."""
    base = case.fit_base(1)
    problem = Problem(Structure(case.system, effects), case.split.fit, base.problem.floor)
    point = problem.start(problem.structure.values({"mass_kg": 4.0, "stiffness_N_m": 190.0, "damping_Ns_m": 19.0}))
    solution = replace(base.solution, point=point, cost=cost_of(problem, point), sensitivities=())
    fitted = Fit(problem, solution, 1, 1)
    return Candidate(fitted, evaluate_on(fitted, case.split.judging), POLICY)


def begin(case: Case) -> Anew:
    return Anew(case.system, case.split, POLICY, NOBODY)


@pytest.mark.slow
def test_of_single_effects_the_right_one_is_followed_whatever_the_base_fit_was():
    case = bench({"delay.delay_s": 0.05}, 61)
    best = min((fitted for fitted, _ in begin(case).follow(lost(case))), key=lambda fitted: fitted.cost)
    assert best.structure.effects == ("delay",)
    assert best.theta["delay.delay_s"] == pytest.approx(0.05, rel=0.1)


@pytest.mark.slow
def test_an_effect_that_isolated_trials_cannot_show_is_followed_where_all_together_do():
    drag = {"quadratic_drag.drag_Ns2_m2": 8.0}
    quiet, dragged = (hide(effects, seed=34) for effects in ({}, drag))
    trials = [d if d.experiment == "sweep" else q for q, d in zip(quiet.trials, dragged.trials, strict=True)]
    late = replace(quiet.effects["quadratic_drag"], experiments=("sweep",))
    system = DragsInSweeps(tuple(trials), {**quiet.effects, "quadratic_drag": late})
    case = Case(system, split_trials(system.trials, system.spare()), POLICY, 0)
    best = min((fitted for fitted, _ in begin(case).follow(lost(case))), key=lambda fitted: fitted.cost)
    assert best.structure.effects == ("quadratic_drag",)
    assert best.theta["quadratic_drag.drag_Ns2_m2"] == pytest.approx(8.0, rel=0.2)


@pytest.mark.slow
def test_a_pair_is_begun_from_its_better_half_and_not_from_a_lost_fit():
    case = bench({"delay.delay_s": 0.06, "cubic_spring.stiffness_N_m3": 8000.0}, 62)
    found = [fitted for fitted, _ in begin(case).follow(lost(case, ("coulomb",)))]
    best = min(found, key=lambda fitted: fitted.cost)
    assert set(best.structure.effects) == {"delay", "cubic_spring"}
    assert judge(best, case.split, POLICY).checked_error < (0, 1.1)


@pytest.mark.slow
def test_where_no_trial_isolates_parameters_every_single_effect_is_followed_and_no_pair():
    hidden = hide({"delay.delay_s": 0.05}, seed=63)
    system = Tangled(hidden.trials, hidden.effects)
    case = Case(system, split_trials(system.trials, system.spare()), POLICY, 0)
    assert len(begin(case).follow(lost(case))) == len(system.effects)
    assert begin(case).follow(lost(case, ("coulomb",))) == []


def test_where_every_trial_isolates_parameters_pairs_are_begun_like_all_others():
    hidden = hide({"delay.delay_s": 0.06, "cubic_spring.stiffness_N_m3": 8000.0}, seed=62)
    case = Case(hidden, split_trials(hidden.trials, hidden.spare()), POLICY, 0)
    found = [fitted for fitted, _ in begin(case).follow(lost(case, ("coulomb",)))]
    assert set(min(found, key=lambda fitted: fitted.cost).structure.effects) == {"delay", "cubic_spring"}


@pytest.mark.slow
def test_either_sign_of_an_effect_is_begun():
    case = bench({"asymmetric_friction.difference_N": -0.8}, 64)
    found = {fitted.structure.effects: fitted for fitted, _ in begin(case).follow(lost(case))}
    assert found[("asymmetric_friction",)].theta["asymmetric_friction.difference_N"] == pytest.approx(-0.8, abs=0.1)


@pytest.mark.slow
def test_what_has_been_begun_is_weighed_again_against_another_floor():
    case = bench({"delay.delay_s": 0.05}, 65)
    before, anew = lost(case), begin(case)
    anew.follow(before)
    problem = before.fitted.problem
    halved = replace(
        problem.floor,
        channels={key: replace(channel, sd=0.5 * channel.sd) for key, channel in problem.floor.channels.items()},
    )
    sharper = Fit(Problem(problem.structure, problem.trials, halved), before.fitted.solution, 1, 1)
    followed = [fitted for fitted, _ in anew.follow(Candidate(sharper, before.checked, POLICY))]
    assert all(fitted.problem.floor is halved for fitted in followed)
    assert np.isfinite([fitted.cost for fitted in followed]).all()


def test_of_several_beginnings_those_with_the_right_effect_look_best_from_afar():
    case = bench({"delay.delay_s": 0.05}, 66)
    floor = case.fit_base(1).problem.floor
    problems = [Problem(Structure(case.system, (name,)), case.split.fit, floor) for name in ("coulomb", "delay")]
    begun = begin_from_afar(NOBODY, "", problems, [[problem.structure.start()] for problem in problems])
    assert promising(begun, 2) == begun[::-1]
    assert begun[1].glanced < 0.1 * begun[0].glanced
    (followed,) = follow_from_afar(NOBODY, "", promising(begun, 1))
    assert followed.cost < 0.7 * sum(r.size for r in problems[1].residuals(followed.point))


def test_where_no_trial_isolates_parameters_nothing_tells_and_all_are_promising():
    hidden = hide({}, seed=63)
    system = Tangled(hidden.trials, hidden.effects)
    case = Case(system, split_trials(system.trials, system.spare()), POLICY, 0)
    problem = case.fit_base(1).problem
    begun = begin_from_afar(NOBODY, "", [problem] * 3, [[problem.structure.start()]] * 3)
    assert len(promising(begun, 1)) == 3


def test_rough_fits_that_do_not_look_promising_stay_as_they_are():
    case = bench({"delay.delay_s": 0.05}, 67)
    base = case.fit_base(1)
    rough = sketches(profiles(base, ["delay", "coulomb"], case.split, base.problem.floor, NOBODY), NOBODY)
    again = {
        p.effect: (near, far) for (near, p), (far, _) in zip(rough, from_initial_guess(rough, NOBODY, 1), strict=True)
    }
    near, far = again["coulomb"]
    assert far.solution is near.solution
    assert again["delay"][1].theta["delay.delay_s"] == pytest.approx(0.05, rel=0.1)


def without(case: Case, effect: str) -> Case:
    """The same data, of an effect that the library lacks."""
    library = {name: known for name, known in case.system.effects.items() if name != effect}
    return Case(Bench(case.system.trials, library), case.split, POLICY, 0)


def learnt(case: Case, parent: Candidate) -> Candidate | None:
    return learn_correction([parent], case.split, enough=case.suffices, policy=POLICY, crew=NOBODY)


@pytest.mark.slow
def test_a_curve_is_begun_anew_where_the_fit_below_it_is_lost(monkeypatch):
    case = without(bench({"cubic_spring.stiffness_N_m3": 8000.0}, 66), "cubic_spring")
    parent = lost(case)
    found = learnt(case, parent)
    assert found.fitted.structure.sites == ("spring",)
    assert found.checked_error < (0, 1.2)
    monkeypatch.setattr("lacuna.diagnosis.learn._begun_anew", lambda *_: [])
    from_there = learnt(case, parent)
    assert from_there is None or from_there.checked.cost > found.checked.cost


def test_a_curve_is_not_begun_anew_on_a_fit_that_leaves_little(monkeypatch):
    case = bench({}, 67)
    monkeypatch.setattr("lacuna.diagnosis.learn.begin", pytest.fail)
    assert learnt(case, case.judge(case.fit_base(1))) is None
