"""Real measurements: the engine names the documented missing effect of the EMPS benchmark and rejects the decoy."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

import lacuna
from lacuna.values import Values

ROOT = Path(__file__).resolve().parents[3]
DATA = ROOT.parent / "shared" / "data" / "emps"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (DATA / "DATA_EMPS.mat").exists(),
        reason=f"the EMPS benchmark's records are not in {DATA.relative_to(ROOT.parent)} beside the checkout",
    ),
]
FILE = ROOT / "docs" / "examples" / "emps.py"


@pytest.fixture(scope="module")
def emps():
    spec = importlib.util.spec_from_file_location("emps", FILE)
    module = importlib.util.module_from_spec(spec)
    sys.modules["emps"] = module  # cached compiled code looks up its module by name
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def verdict(emps):
    return lacuna.diagnose(emps.system, emps.windows(emps.read(DATA / "DATA_EMPS.mat")), progress=False)


def test_names_friction_and_its_asymmetry(verdict):
    assert verdict.verdict == "identified"
    assert {e.name for e in verdict.effects} == {"viscous", "coulomb", "asymmetric_friction"}


def test_reaches_the_published_errors_on_both_records(emps, verdict):
    """The RMS error over 1 s windows, each started at its measured position and speed, as for SciPy's fits."""

    def rmse_mm(file, theta):
        errors = []
        for record in (table.record(["position_mm"]) for table in emps.windows(emps.read(DATA / file))):
            predicted = emps.simulate(record, Values(theta | {"v_m_s": record["speed_m_s"][0]}))
            errors.append(predicted["position_mm"] - record["position_mm"])
        return np.sqrt(np.mean(np.concatenate(errors) ** 2))

    theta = emps.system.values({}) | verdict.theta
    assert rmse_mm("DATA_EMPS.mat", theta) <= 0.407
    assert rmse_mm("DATA_EMPS_PULSES.mat", theta) <= 1.388


def test_rejects_the_decoy_where_the_pulses_were_applied(emps):
    """The decoy is also rejected if no window repeats another, with the pulses at other phases of each cycle."""
    tables = lacuna.windows(emps.read(DATA / "DATA_EMPS_PULSES.mat"), 1.0, every=1.04)
    found = lacuna.diagnose(emps.system, tables, progress=False)
    names = {e.name for e in found.effects}
    assert "pulses" not in names | {c for e in found.effects for c in e.confusable_with}
    assert "asymmetric_friction" in names


def test_a_cycle_of_another_length_is_refused(emps):
    """If 6.249 s is declared in place of 6.240 s, the windows drift apart, and the drift would pass for noise."""
    tables = lacuna.windows(emps.read(DATA / "DATA_EMPS.mat"), 1.0, every=6.249 / 6, period=6.249)
    with pytest.raises(lacuna.LacunaError, match="declared as repeats"):
        lacuna.diagnose(emps.system, tables, progress=False)


def test_the_example_is_short():
    code = [line for line in FILE.read_text().splitlines() if line.strip() and not line.startswith(("import", "from"))]
    assert len(code) <= 40
