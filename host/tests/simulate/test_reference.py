"""The simulator, compared with an independent, event-driven solution of eq. (1)-(8)."""

from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from multiprocessing import get_context

import numpy as np
import pytest

from bifa import robot, simulate
from bifa.robot import Gait
from bifa.simulate.paper import FAST

from . import reference

CYCLES = 10
FINE_M, FINEST_M = 1e-7, 1e-8
WALKS_MM_S = 2.0
# A gait is on a cliff if a relative change of 1e-6 in the reference's static friction moves its result by more than
# this: its advance is then no number to compare with.
CLIFF = 1e-3


def _errors(gaits, *tolerances_m, workers=1):
    """(tolerances, gaits) relative errors of the last cycle's advance; NaN on a cliff."""
    model, rows = robot.nominal(), simulate.gait_rows(gaits)
    with ProcessPoolExecutor(workers, get_context("spawn")) if workers > 1 else nullcontext() as pool:
        exact = np.array(list((pool.map if pool else map)(_reference_or_cliff, gaits)))
    ours = [simulate.speeds(model, rows, CYCLES, tolerance).advance_m[:, -1] for tolerance in tolerances_m]
    return np.abs(np.array(ours) / exact - 1.0)


def _reference_or_cliff(gait):
    model = robot.nominal()
    advance = _reference_advance(model, gait)
    nearby = _reference_advance(model.with_values({"mu_s": model["mu_s"] * (1.0 + 1e-6)}), gait)
    return np.nan if abs(nearby / advance - 1.0) > CLIFF else advance


def _reference_advance(model, gait):
    head = reference.walk(model, gait, gait.period_s * np.arange(1, CYCLES + 1), 1e-11)[:, 0]
    return head[-1] - head[-2]


def _walking_gaits(count, seed):
    rng, gaits = np.random.default_rng(seed), []
    while len(gaits) < count:
        angles, duty = rng.uniform(0.0, 360.0, 2), rng.uniform(0.2, 0.8, 2)
        gait = Gait(rng.uniform(2.0, 6.0), *angles, duty[0], duty[1], duty[1])
        if abs(simulate.speed(robot.nominal(), gait, CYCLES).speed_mm_s) > WALKS_MM_S:
            gaits.append(gait)
    return gaits


def test_baseline_and_fastest_gait():
    assert np.all(_errors([robot.BASELINE, FAST], FINE_M) < 1e-4)


def test_random_walking_gaits():
    errors = _errors(_walking_gaits(8, seed=1), FINE_M)
    assert np.count_nonzero(np.isnan(errors)) <= 1
    assert np.nanmax(errors) < 1e-3


@pytest.mark.soak
def test_two_hundred_walking_gaits(capsys):
    tolerances = (1e-6, FINE_M, FINEST_M)
    errors = _errors(_walking_gaits(210, seed=2), *tolerances, workers=simulate.cores())
    cliffs = np.isnan(errors[0])
    with capsys.disabled():
        print(f"\n{np.count_nonzero(~cliffs)} walking gaits against the reference, {np.count_nonzero(cliffs)} cliffs")
        for tolerance, of in zip(tolerances, errors[:, ~cliffs], strict=True):
            within = f"{np.count_nonzero(of < 1e-3)} within 0.1 %"
            print(f"  tolerance {tolerance:g} m: median {np.median(of):.1e}, worst {of.max():.1e}, {within}")
    assert np.count_nonzero(~cliffs) >= 200
    assert errors[2, ~cliffs].max() < 1e-3
    assert np.mean(errors[1, ~cliffs] < 1e-3) >= 0.99


@pytest.mark.parametrize("gait", [robot.BASELINE, FAST], ids=["baseline", "fastest"])
def test_every_channel_of_a_record(gait):
    model = robot.nominal()
    record = simulate.walk(model, gait, 3, tolerance_m=1e-8)
    states = reference.walk(model, gait, record["time_s"])
    v = model.values
    head = 1e3 * (states[:, 0] - states[0, 0])
    body = (states[:, 4] - v["body_damping_Ns_m"] * (states[:, 1] - states[:, 3])) / v["body_area_N_psi"]
    small = (states[:, [7, 10]] - v["small_damping_Ns_m"] * states[:, [6, 9]]) / v["small_area_N_psi"]
    np.testing.assert_allclose(record["displacement_head_mm"], head, atol=0.01)
    np.testing.assert_allclose(record["displacement_tail_mm"], 1e3 * states[:, 2], atol=0.01)
    np.testing.assert_allclose(record["pressure_body_psi"], body, atol=0.02)
    np.testing.assert_allclose(record["pressure_head_psi"], small[:, 0], atol=0.02)
    np.testing.assert_allclose(record["pressure_tail_psi"], small[:, 1], atol=0.02)
    np.testing.assert_allclose(record["small_head_m"], states[:, 5], atol=1e-5)


def test_friction_work_is_never_given_back():
    """The work of the pressure, less the stored and damped energy, is what friction took: it only grows."""
    model, gait = robot.nominal(), FAST
    time = np.arange(0.0, 2.0 * gait.period_s, 2e-5)
    s = simulate.walk(model, gait, time_s=time, tolerance_m=1e-8)
    area, damping = model["body_area_N_psi"], model["body_damping_Ns_m"]
    opening = s["velocity_head_m_s"] - s["velocity_tail_m_s"]
    force = area * s["pressure_body_psi"] + damping * opening
    power = force * opening - damping * opening**2 - model.body_stiffness.force(s["body_m"]) * opening
    kinetic = 0.5 * model["head_mass_kg"] * s["velocity_head_m_s"] ** 2
    kinetic += 0.5 * model["tail_mass_kg"] * s["velocity_tail_m_s"] ** 2
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(time))]) - kinetic
    taken = work[::500]  # every 10 ms, so that the trapezoidal error at the jerks is small against the work
    assert taken[-1] > 0.1
    assert np.diff(taken).min() > -2e-4
