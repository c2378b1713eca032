"""Learnt curves with the shape of a known term or effect act as that term or effect."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from bifa.problem.sites import SITES, corrected, learnt_curves
from bifa.robot.learnt import ROWS
from bifa.simulate import plant, vented_between
from lacuna.system import Correction


def curve(system, name, function) -> Correction:
    """`function` of the site's variable, on its grid, for every direction."""
    site = system.correction_sites[name]
    values = function(np.linspace(site.lower, site.upper, 65))
    return Correction(name, np.array([values] * len(site.rows)))


def trial_of(system, experiment):
    return [t for t in system.trials if t.experiment == experiment][-1]


def predict(system, theta, experiment, *corrections):
    return system.predict(theta, (), trial_of(system, experiment), corrections=corrections)


def test_the_equations_have_the_rows_of_their_sites_and_a_curve_outside_acts_somewhere():
    in_equations = {name: len(site.rows) for name, site in SITES.items() if site.equation}
    assert in_equations == ROWS
    hooks = ("plant", "inputs", "readings")
    for name, site in SITES.items():
        own = [hook for hook in hooks if getattr(site, hook)]
        assert len(own) == (0 if site.equation else 1), name


@pytest.mark.slow
def test_a_damper_learnt_as_a_straight_line_is_more_damping(system, theta):
    body = next(t for t in system.trials if t.experiment == "step_response")
    learnt = curve(system, "body_damper", lambda v: 20.0 * v)
    more = theta | {"body_damping_Ns_m": theta["body_damping_Ns_m"] + 20.0}
    got, want, plain = (
        system.predict(at, (), body, corrections=corrections)["displacement_mm"]
        for at, corrections in ((theta, (learnt,)), (more, ()), (theta, ()))
    )
    assert got == pytest.approx(want, abs=0.02)
    assert np.ptp(got - plain) > 0.5


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
    assert trial_of(system, "locomotion").session_order == len(system.trials) - 1
    got = predict(system, theta, "locomotion", last)["displacement_head_mm"]
    assert got == pytest.approx(predict(system, stiffer, "locomotion")["displacement_head_mm"], abs=1e-9)


def test_the_camera_reads_with_what_was_learnt(system, theta):
    scaled = predict(system, theta, "locomotion", curve(system, "camera", lambda x: 0.03 * x))
    plain = predict(system, theta, "locomotion")
    inside = np.abs(plain["displacement_tail_mm"]) < 90.0
    assert scaled["displacement_tail_mm"][inside] == pytest.approx(
        1.03 * plain["displacement_tail_mm"][inside], abs=1e-6
    )


@pytest.mark.parametrize(("experiment", "channel"), [("locomotion", "head"), ("step_response", "")])
def test_a_camera_that_remembers_is_one_on_a_mount_that_rings(system, theta, experiment, channel):
    omega, damping = 2.0 * np.pi * 6.0, 0.1  # decays within the memory
    swing, decay = omega * np.sqrt(1.0 - damping**2), damping * omega

    def after_a_step(ago_s):
        return -np.exp(-decay * ago_s) * (np.cos(swing * ago_s) - decay / swing * np.sin(swing * ago_s))

    site = system.correction_sites["camera_memory"]
    at = np.linspace(site.lower, site.upper, 481)
    learnt = Correction(site.name, np.array([after_a_step(at), 0.0 * at, 0.0 * at]))
    trial = next(t for t in system.trials if t.experiment == experiment and t.payload.actuator in (None, "large"))
    plain, got = (system.predict(theta, (), trial, corrections=one) for one in ((), (learnt,)))
    name = f"displacement_{channel}_mm" if channel else "displacement_mm"
    mount = ([-1.0, 0.0, 0.0], [1.0, 2.0 * decay, omega**2])  # r'' + 2 zeta omega r' + omega^2 r = -x''
    moved_mm = plain[name] - plain[name][0]
    rings_mm = lsim(mount, moved_mm, np.arange(len(moved_mm)) * 0.01)[1]
    seen_mm = got[name] - plain[name]
    assert np.abs(rings_mm).max() > 1.0
    assert np.sqrt(np.mean((seen_mm - rings_mm) ** 2)) < 0.1 * np.sqrt(np.mean(rings_mm**2))
    for other in plain.keys() - {name}:
        np.testing.assert_array_equal(got[other], plain[other])


SWITCHED = ("step_response", "locomotion")
# Of each site: a curve (one row each if they differ), the equivalent effect of the library, and where it shows.
ALIKE = {
    "filling": ([lambda p: -0.05 * p], {"leak.rate_per_s": 0.05}, ("locomotion",)),
    "valves": ([lambda _: 0.03], {"valve_latency.delay_s": 0.03}, SWITCHED),
    "area_stroke": (
        [lambda x: 0.1 * x],
        {"area_variation.slope": 0.1, "area_variation.force_kept": 0.0},
        ("static_loading",),
    ),
    "grip_speed": (
        [lambda _: 0.15, lambda _: -0.15],
        {"friction_direction.asymmetry": 0.15},
        ("anchor_pull", "locomotion"),
    ),
    "pressure_sensor_memory": ([lambda ago_s: -np.exp(-ago_s / 0.05)], {"sensor_lag.time_s": 0.05}, SWITCHED),
    "pressure_sensor_inflow": ([lambda drop_psi: 0.05 * drop_psi], {"sensor_position.share": 0.05}, SWITCHED),
}


def with_dead_time(trial):
    if trial.experiment not in SWITCHED:
        return trial
    return replace(trial, payload=replace(trial.payload, commands=vented_between(trial.payload.commands, 0.004)))


@pytest.mark.parametrize("as_recorded", [lambda trial: trial, with_dead_time], ids=["plain", "with dead time"])
@pytest.mark.parametrize(("site", "experiment"), [(name, where) for name, alike in ALIKE.items() for where in alike[2]])
def test_a_curve_in_the_shape_of_an_effect_is_that_effect(system, theta, site, experiment, as_recorded):
    rows, effect, _ = ALIKE[site]
    here = system.correction_sites[site]
    at = np.linspace(here.lower, here.upper, 257)
    every = rows if len(rows) == len(here.rows) else rows * len(here.rows)
    learnt = Correction(site, np.array([np.broadcast_to(row(at), at.shape) for row in every]))
    names = tuple({name.split(".")[0] for name in effect})
    trial = as_recorded(trial_of(system, experiment))
    plain = system.predict(theta, (), trial)
    want = system.predict(theta | effect, names, trial)
    got = system.predict(theta, (), trial, corrections=(learnt,))
    moved = {channel: np.abs(want[channel] - plain[channel]).max() for channel in want}
    assert max(moved.values()) > 0.05
    for channel, much in moved.items():
        missed = np.sqrt(np.mean((got[channel] - want[channel]) ** 2))
        assert missed < 0.05 * np.sqrt(np.mean((want[channel] - plain[channel]) ** 2)) + 2e-3, (channel, much)


def test_a_pull_meets_the_friction_of_the_place_that_it_has_reached(system, theta):
    def lip(at_m):
        return 0.4 * np.exp(-0.5 * ((at_m - 0.03) / 0.004) ** 2)

    site, pull = system.correction_sites["grip_pulled"], trial_of(system, "anchor_pull").payload
    learnt = lip(np.linspace(site.lower, site.upper, 513))
    got = predict(system, theta, "anchor_pull", Correction(site.name, np.array([learnt, 0.0 * learnt])))["force_N"]
    plain = predict(system, theta, "anchor_pull")["force_N"]
    pulled_m = 1e-3 * pull.pulled_s * abs(pull.rate_mm_s)
    sliding = pulled_m > 0.01
    assert got[sliding] / plain[sliding] == pytest.approx(1.0 + lip(pulled_m[sliding]), rel=0.01)


def test_a_sensor_sees_another_chamber_by_the_row_of_that_pair(system, theta):
    site = system.correction_sites["pressure_sensor_others"]
    table = np.zeros((len(site.rows), 9))
    table[site.rows.index("head by body")] = 0.04 * np.linspace(site.lower, site.upper, 9)
    got = predict(system, theta, "locomotion", Correction(site.name, table))
    plain = predict(system, theta, "locomotion")
    seen = plain["pressure_head_psi"] + 0.04 * plain["pressure_body_psi"]
    assert got["pressure_head_psi"] == pytest.approx(seen, abs=1e-9)
    assert got["pressure_tail_psi"] == pytest.approx(plain["pressure_tail_psi"], abs=1e-12)


def test_slow_loading_differs_by_direction_on_the_actuator_that_it_was_learnt_for(system, theta):
    table = np.array([np.full(9, 2.0), np.full(9, -1.0)])
    large, small = (
        [t for t in system.trials if t.experiment == "static_loading" and t.payload.actuator == which][-1]
        for which in ("large", "small")
    )

    def added(trial):
        got, plain = (
            system.predict(theta, (), trial, corrections=c) for c in ([Correction("body_loading", table)], ())
        )
        return got["force_N"] - plain["force_N"]

    assert added(large) == pytest.approx(np.where(large.payload.direction > 0, 2.0, -1.0))
    assert not added(small).any()


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
