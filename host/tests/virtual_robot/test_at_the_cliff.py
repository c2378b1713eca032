"""At a cliff single ticks of the Uno decide whether a robot walks. The host's model and the virtual robot, the real
firmware in a simulated chip, agree on each gait there."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.campaign.walks import speed_of
from bifa.gait import library
from bifa.gait.prediction import predict_speed
from bifa.gait.settling import Walking
from bifa.gait.uncertainty import spread_of
from bifa.link import Uno
from bifa.link.units import set_point_psi
from bifa.link.uno import DEAD_TIME_S
from bifa.measure.experiments import record_trial
from bifa.measure.plan import PlannedTrial
from bifa.measure.recording import bench_of
from bifa.ranges import TICK_S
from bifa.rig import open_rig
from bifa.robot import Covariance, nominal
from bifa.robot.model import Scatter

pytestmark = pytest.mark.uno


def certain(tick_s):
    """The nominal model, known exactly, at the regulator's actual set-point."""
    exact = nominal().with_values({"supply_positive_psi": set_point_psi(8.5)})
    timing = Scatter(dead_time_s=DEAD_TIME_S, tick_s=tick_s)
    return replace(exact, covariance=Covariance(("mu_k",), np.array([[1e-12]])), scatter=timing)


def predicted_mm_s(gait, tick_s=TICK_S):
    model = certain(tick_s)
    return predict_speed(model, spread_of(model).naive, gait, draws=4).speed_mm_s


@pytest.mark.parametrize(
    ("longer", "walks"),
    [(17e-4, True), (16e-4, False), (15e-4, True), (14e-4, True), (13e-4, True), (12e-4, False)],
)
def test_the_robot_walks_with_the_gaits_with_which_it_is_predicted_to(longer, walks):
    fast = library.load("fast").gait
    gait = replace(fast, period_s=(1.0 + longer) * fast.period_s)
    with open_rig("virtual", seed=3, profile="ideal") as rig, Uno(rig.transport, rig.clock, seed=1) as uno:
        uno.connect()
        walked = speed_of(record_trial(bench_of(rig), uno, PlannedTrial("locomotion", gait=gait, cycles=12)))
    assert (walked.walking is Walking.SETTLED) == walks
    assert predicted_mm_s(gait) == pytest.approx(walked.mean_mm_s if walks else 0.0, abs=0.04)  # the camera: 0.01
    if longer == 14e-4:
        assert predicted_mm_s(gait, tick_s=0.0) < 1.0, "from the ticks alone"
