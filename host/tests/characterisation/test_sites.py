"""Learnt curves in the shape of something that the model knows do what that does."""

from dataclasses import replace

import numpy as np
import pytest
from independent_lab import BASELINE, Lab

from bifa.characterisation.sites import corrected, learnt_curves
from bifa.characterisation.system import prepare
from bifa.data import Dataset
from bifa.identify.system import Correction
from bifa.simulate import plant


@pytest.fixture(scope="module")
def system():
    lab = Lab().with_seed(4)
    trials = [lab.static(which, p) for which in ("large", "small") for p in (0.0, 8.0)]
    trials += [lab.step(which, 8.5) for which in ("large", "small")]
    trials += [lab.anchor(8.5), lab.walk(BASELINE, 8.0)]
    known = {"supply_positive_psi": lab.positive, "supply_negative_psi": lab.negative}
    numbered = tuple(replace(t, file=f"{i:02d}.csv", session_order=i + 1) for i, t in enumerate(trials))
    return prepare(Dataset(path=None, name="small day", known=known, trials=numbered))


@pytest.fixture(scope="module")
def theta(system):
    return {p.name: p.value for p in system.parameters}


def curve(system, name, function) -> Correction:
    """`function` of the site's variable, on its grid, for every direction."""
    site = system.correction_sites[name]
    values = function(np.linspace(site.lower, site.upper, 65))
    return Correction(name, np.array([values] * (2 if site.by_direction else 1)))


def trial_of(system, experiment):
    return [t for t in system.trials if t.experiment == experiment][-1]


def predict(system, theta, experiment, *corrections, effects=()):
    return system.predict(theta, effects, trial_of(system, experiment), corrections=corrections)


def test_a_damper_learnt_as_a_straight_line_is_more_damping(system, theta):
    body = next(t for t in system.trials if t.experiment == "step_response")
    learnt = curve(system, "body_damper", lambda v: 20.0 * v)
    more = theta | {"body_damping_Ns_m": theta["body_damping_Ns_m"] + 20.0}
    got = system.predict(theta, (), body, corrections=(learnt,))["displacement_mm"]
    assert got == pytest.approx(system.predict(more, (), body)["displacement_mm"], abs=0.02)
    assert np.ptp(got - system.predict(theta, (), body)["displacement_mm"]) > 0.5


def test_a_rate_learnt_as_a_loss_is_a_leak(system, theta):
    learnt = curve(system, "filling", lambda p: -0.05 * p)
    leaky = theta | {"leak.rate_per_s": 0.05}
    got = predict(system, theta, "locomotion", learnt)
    want = predict(system, leaky, "locomotion", effects=("leak",))
    for channel in ("pressure_body_psi", "pressure_head_psi"):
        assert got[channel] == pytest.approx(want[channel], abs=0.02)


def test_a_constant_friction_slows_the_robot_whether_by_speed_or_by_place(system, theta):
    plain = predict(system, theta, "locomotion")["displacement_head_mm"]
    by_speed, by_place = (
        predict(system, theta, "locomotion", curve(system, name, lambda x: np.full(x.shape, 3.0)))
        for name in ("friction_speed", "friction_place")
    )
    assert by_speed["displacement_head_mm"] == pytest.approx(by_place["displacement_head_mm"], abs=1e-9)
    assert by_speed["displacement_head_mm"][-1] < plain[-1] - 0.1
    nothing = predict(system, theta, "locomotion", curve(system, "friction_speed", np.zeros_like))
    assert nothing["displacement_head_mm"] == pytest.approx(plain, abs=1e-9)


def test_what_changes_over_the_day_changes_by_the_place_in_the_session(system, theta):
    last = curve(system, "friction_of_the_day", lambda share: 0.1 * share)
    stiffer = theta | {name: 1.1 * theta[name] for name in ("mu_s", "mu_k")}
    assert trial_of(system, "locomotion").session_order == len(system.trials)
    got = predict(system, theta, "locomotion", last)["displacement_head_mm"]
    assert got == pytest.approx(predict(system, stiffer, "locomotion")["displacement_head_mm"], abs=1e-9)


def test_the_camera_reads_with_what_was_learnt(system, theta):
    scaled = predict(system, theta, "locomotion", curve(system, "camera", lambda x: 0.03 * x))
    plain = predict(system, theta, "locomotion")
    inside = np.abs(plain["displacement_tail_mm"]) < 90.0
    assert scaled["displacement_tail_mm"][inside] == pytest.approx(
        1.03 * plain["displacement_tail_mm"][inside], abs=1e-6
    )


def test_a_model_takes_along_what_was_learnt_in_the_robot_but_not_in_its_instruments(system, theta):
    corrections = [
        curve(system, "body_spring", lambda x: 3.0 * np.sin(300.0 * x)),
        curve(system, "filling", lambda p: -0.03 * p),
        curve(system, "camera", lambda x: 0.03 * x),
    ]
    model = system.model_at(theta, ())
    kept = learnt_curves(plant(model), corrections)
    assert set(kept) == {"body_spring", "filling"}
    got, want = plant(replace(model, learnt=kept)), corrected(plant(model), corrections)
    for ours, theirs in zip(got, want, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert not np.array_equal(got.body_curve, plant(model).body_curve)
