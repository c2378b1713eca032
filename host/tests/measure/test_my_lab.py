"""The example of docs/campaign.md, a rig of a lab's own drivers found by its entry point, measures."""

import shutil
import sys
import tomllib
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

import bifa.rig.rig
from bifa.measure.session import run_session
from bifa.rig import is_offered, open_rig
from harness.lab import PLAN

pytestmark = pytest.mark.uno
EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "my_lab"


def vendor(stand) -> ModuleType:
    """The vendor's driver, with the virtual bench's instruments behind it."""

    class Device:
        def arm(self):
            stand.start()

        def read(self):
            record = stand.stop()
            return SimpleNamespace(
                time_s=record["time_s"],
                strobes_s=record["sync_time_s"],
                extension_mm=record.get("displacement_mm"),
                load_N=record.get("force_N"),
                head_mm=record.get("displacement_head_mm", record.get("displacement_mm")),
                tail_mm=record.get("displacement_tail_mm"),
            )

    class Machine(Device):
        def travel(self, travel_mm, rate_mm_s, there_and_back):
            assert travel_mm in (30.0, 40.0)
            assert rate_mm_s in (20.0, 40.0)
            stand.move()

        @property
        def busy(self):
            return stand.moving

    acme = ModuleType("acme")
    acme.Camera, acme.Machine = Device, Machine

    def technician(text):
        name = text.split()[1].strip(",")
        known = {"actuator": "small"} if name in ("static_loading", "step_response") else {}
        rate = {"static_loading": {"rate_mm_s": 20.0}, "anchor_pull": {"rate_mm_s": 40.0, "travel_mm": 40.0}}
        stand.mount(name, **known, **rate.get(name, {}))

    acme.ask_the_technician = technician
    return acme


@pytest.fixture
def installed(rig, tmp_path, monkeypatch):
    """The example as installed by pip, on a bench whose serial port leads to the virtual Uno."""
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    shutil.copy(EXAMPLE / "my_lab.py", tmp_path)
    info = tmp_path / "my_lab-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: 1\n")
    named = "\n".join(f"{name} = {target}" for name, target in project["entry-points"]["bifa.rigs"].items())
    (info / "entry_points.txt").write_text(f"[bifa.rigs]\n{named}\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "acme", vendor(rig.instruments))
    monkeypatch.setattr(bifa.rig.rig, "SerialTransport", lambda device: rig.transport)
    monkeypatch.setattr(bifa.rig.rig, "WallClock", lambda: rig.clock)
    yield
    sys.modules.pop("my_lab", None)


def test_the_example_measures_every_experiment(installed, tmp_path):
    assert is_offered("my-lab")
    with open_rig("my-lab", device="/dev/ttyACM0") as rig:
        assert rig.known["head_mass_kg"] == 0.182
        day = run_session(rig, tmp_path / "day", PLAN, name="a day", known=rig.known, provenance={})
    assert [trial.experiment for trial in day.trials] == [planned.experiment for planned in PLAN]
    assert all(trial.extra["clock_error_s"] < 1e-4 for trial in day.trials)
    assert day.trials[0].columns["displacement_mm"].max() > 29.0
    assert "displacement_tail_mm" in day.trials[3].columns
