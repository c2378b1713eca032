"""The host's CPG: eq. (9) settles at the phases that the thresholds assume."""

import math

import numpy as np
import pytest

from bifa.robot import BASELINE, Gait, cpg


@pytest.mark.parametrize("seed", range(5))
def test_phases_settle_at_plus_psi(seed):
    rng = np.random.default_rng(seed)
    gait = Gait(rng.uniform(1, 6), rng.uniform(0, 360), rng.uniform(0, 360), 0.5, 0.5, 0.5)
    start = cpg.phase_offsets_rad(gait) + rng.uniform(-1.0, 1.0, 3)
    settled = cpg.phases(gait, np.array([4.0]), start)[0]
    difference = np.exp(1j * (settled - settled[0] - cpg.phase_offsets_rad(gait)))
    np.testing.assert_allclose(difference, 1.0, atol=1e-9)


def test_settled_phases_run_at_the_gaits_frequency():
    rates = cpg.phase_rates(cpg.phase_offsets_rad(BASELINE) + 0.7, BASELINE)
    np.testing.assert_allclose(rates, 2 * math.pi / BASELINE.period_s, rtol=1e-12)


def test_duty_is_the_vacuum_fraction():
    gait = Gait(4.0, 90.0, 180.0, 0.2, 0.5, 0.8)
    time = np.linspace(0, 4.0, 4001)[:-1]
    phases = cpg.phases(gait, time, cpg.phase_offsets_rad(gait))
    positive = np.mean([cpg.outputs(phase, gait) for phase in phases], axis=0)
    np.testing.assert_allclose(positive, [0.8, 0.5, 0.2], atol=2e-3)
