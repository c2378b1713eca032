"""Which supply a walk in a fit has."""

from dataclasses import replace

import pytest

from bifa.data import Dataset
from bifa.identify.start import prepare
from harness.independent_lab import BASELINE, IndependentLab

SET_POINT = {"set_point_psi": 8.4741}


@pytest.fixture(scope="module")
def lab():
    return IndependentLab().with_seed(6)


def highest_psi(lab, gauge_psi, **trial):
    """Of the body in a walk, as the model of a lab whose gauge says `gauge_psi` predicts it."""
    statics = [lab.static(which, p, rate_mm_s=4.0) for which in ("large", "small") for p in (0.0, 8.0)]
    walk = replace(lab.walk(BASELINE, 6.0), **{"extra": SET_POINT} | trial)
    trials = tuple(replace(t, file=f"{i}.csv") for i, t in enumerate([*statics, walk]))
    system = prepare(Dataset(None, "day", {"supply_positive_psi": gauge_psi}, trials))
    predicted = system.predict({p.name: p.value for p in system.parameters}, (), system.trials[-1])
    return predicted["pressure_body_psi"].max()


def test_the_gauge_counts_and_not_the_set_point(lab):
    told = [highest_psi(lab, gauge_psi) for gauge_psi in (8.0, 9.0)]
    assert told == pytest.approx([8.0, 9.0], abs=0.15)


def test_a_walk_at_a_pressure_of_its_own_has_its_set_point(lab):
    told = highest_psi(lab, 9.0, pressure_psi=6.5, extra={"set_point_psi": 6.49})
    assert told == pytest.approx(6.49, abs=0.15)
