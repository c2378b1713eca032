"""Real measurements: the engine names the documented missing effect of the EMPS benchmark and rejects the decoy."""

import importlib.util
import sys
from pathlib import Path

import pytest

from lacuna.diagnosis.diagnose import diagnose

ROOT = Path(__file__).resolve().parents[3]
DATA = ROOT.parent / "shared" / "data" / "emps"
pytestmark = pytest.mark.skipif(
    not (DATA / "DATA_EMPS.mat").exists(),
    reason=f"the EMPS benchmark's records are not in {DATA.relative_to(ROOT.parent)} beside the checkout",
)


@pytest.fixture(scope="module")
def emps():
    spec = importlib.util.spec_from_file_location("emps", ROOT / "docs" / "examples" / "emps.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["emps"] = module  # compiled code that is loaded again looks its module up by name
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def fitted(emps):
    return diagnose(emps.Emps(DATA / "DATA_EMPS.mat"))


def test_names_friction_and_its_asymmetry(fitted):
    assert fitted.verdict == "identified"
    assert {e.name for e in fitted.effects} == {"viscous", "coulomb", "asymmetric_friction"}


def test_reaches_the_published_errors_on_both_records(emps, fitted):
    own, other = emps.Emps(DATA / "DATA_EMPS.mat"), emps.Emps(DATA / "DATA_EMPS_PULSES.mat")
    whole = emps.Emps(DATA / "DATA_EMPS_PULSES.mat", whole=True)
    first = fitted.search.with_effects(["viscous", "offset", "coulomb"]).fitted.theta
    assert own.rmse_mm(first) <= 1.390
    assert other.rmse_mm(first) <= 1.974
    after = fitted.final.theta
    assert own.rmse_mm(after) <= 0.407
    assert other.rmse_mm(after) <= 1.388
    assert whole.rmse_mm(after) <= 7.7


def test_rejects_the_decoy_where_the_pulses_were_applied(emps):
    found = diagnose(emps.Emps(DATA / "DATA_EMPS_PULSES.mat"))
    names = {e.name for e in found.effects}
    assert "pulses" not in names | {c for e in found.effects for c in e.confusable_with}
    assert "asymmetric_friction" in names
