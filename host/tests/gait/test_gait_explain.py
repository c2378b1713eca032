"""The paper's three reasons, reproduced in numbers; sensitivity and front."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.gait.explain import anatomy, reasons
from bifa.gait.metric import Metric
from bifa.gait.sensitivity import Front, sensitivity
from bifa.gait.uncertainty import spread_of
from bifa.robot import BASELINE, Gait, nominal
from bifa.simulate import Supports, tunnel
from bifa.simulate.paper import FAST
from bifa.simulate.passing import passing

ROBUST = Gait(2.6729, 193.168, 325.634, 0.654, 0.4303, 0.4303)


@pytest.fixture(scope="module")
def both():
    return anatomy(nominal(), BASELINE), anatomy(nominal(), ROBUST)


def test_the_three_reasons_of_the_paper(both):
    before, after = both
    assert before.tail_lead_s == pytest.approx(5.7 / 4, abs=1e-6)  # a quarter of the cycle
    assert before.head_lead_s == pytest.approx(5.7 / 4, abs=1e-6)
    assert before.speed_mm_s == pytest.approx(10.83, abs=0.02)
    assert after.speed_mm_s > 2 * before.speed_mm_s
    # More time for contraction, since it takes longer.
    assert after.contraction_s > 1.5 * after.extension_s
    assert after.gait.duty_body > 0.6
    # The ends are commanded to anchor closer to the body's switches.
    assert 0 < after.tail_lead_s < 0.5 * before.tail_lead_s
    assert 0 < after.head_lead_s < 0.5 * before.head_lead_s
    # Pressures do not settle before they are reversed.
    assert after.extended_psi < before.extended_psi - 1
    assert after.contracted_psi > before.contracted_psi + 1


def test_a_body_that_never_snaps_is_said_so():
    stuck = anatomy(nominal(), Gait(0.5, 0.0, 180.0, 0.5, 0.5, 0.5))
    assert np.isnan(stuck.contraction_s)
    assert "never after the command" in reasons(anatomy(nominal(), BASELINE), stuck)[1]


def test_sensitivity_scans_every_parameter_around_the_gait(runs, nominal_plant):
    draws = spread_of(nominal()).plants(nominal(), 8, 1)
    scans = sensitivity(runs, nominal_plant, draws, ROBUST, Metric().quicker(), points=5)
    assert [scan.name for scan in scans] == list(ROBUST.as_dict())
    for scan in scans:
        assert scan.values[2] == pytest.approx(scan.at)
        assert scan.nominal_mm_s[2] == pytest.approx(22.15, abs=0.1)
        assert scan.room[0] <= scan.at <= scan.room[1]
        assert scan.quantile_mm_s.shape == (5,)
    period = scans[0]
    assert period.nominal_mm_s[0] < 2.0  # 15 % faster: the body no longer snaps
    assert period.nominal_mm_s[4] == pytest.approx(22.15 / 1.15, rel=0.05)


def test_a_gait_with_which_one_robot_in_ten_stands_has_no_room(runs, nominal_plant):
    draws = spread_of(nominal()).plants(nominal(), 8, 1)
    for scan in sensitivity(runs, nominal_plant, draws, FAST, Metric().quicker(), points=5):
        assert scan.nominal_mm_s[2] > 20.0
        assert scan.quantile_mm_s[2] < 1.0
        assert scan.room == (scan.at, scan.at)


def test_no_scan_leaves_what_a_gait_may_be(runs, nominal_plant):
    edge = replace(ROBUST, duty_head=0.98)
    scans = {scan.name: scan for scan in sensitivity(runs, nominal_plant, [nominal_plant], edge, Metric().quicker(), 3)}
    assert scans["duty_head"].values.max() == scans["duty_head"].room[1] == 1.0
    assert scans["psi12_deg"].values[2] == ROBUST.psi12_deg + 40.0  # phases wrap


def test_the_front_keeps_what_nothing_beats():
    front = Front(np.zeros((4, 6)), np.array([23.0, 22.0, 21.0, 22.5]), np.array([0.0, 21.8, 21.7, 20.0]))
    np.testing.assert_array_equal(front.efficient, [True, True, False, True])


def test_what_a_body_builds_up_is_not_what_its_sensor_says(both):
    """With a sensor gain of -0.3, a walk that passes was once reported to lack force."""
    misread = nominal().with_effects({"sensor_calibration": {"gain": -0.3, "offset_psi": 0.0}})
    before, after = (passing(model, BASELINE, tunnel(), Supports()) for model in (nominal(), misread))
    assert after.extension.built_up_N == before.extension.built_up_N > before.extension.needed_N
    assert after.contraction.built_up_N == before.contraction.built_up_N
    found = anatomy(misread, BASELINE)
    assert (found.extended_psi, found.contracted_psi) == (both[0].extended_psi, both[0].contracted_psi)
