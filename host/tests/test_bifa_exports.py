"""`import bifa` offers what a notebook needs, with types, and imports its dependencies only when they are used."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bifa
import lacuna
from bifa.data import Dataset, write_dataset


@pytest.fixture(scope="module")
def walk():
    return bifa.Robot().simulate(cycles=2)


def test_everything_offered_is_there():
    assert all(getattr(bifa, name) is not None for name in bifa.__all__)
    with pytest.raises(AttributeError, match=r"bifa has no Bobot; it has .*Robot"):
        bifa.Bobot  # noqa: B018


def test_importing_bifa_loads_nothing_else():
    code = "import sys, bifa; print([m for m in ('numpy', 'scipy', 'numba', 'lacuna') if m in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_a_walk_is_a_trial_that_a_data_set_may_hold(walk, tmp_path):
    write_dataset(tmp_path / "walks", Dataset(None, "walks", {}, (walk,)))
    (again,) = bifa.load_dataset(tmp_path / "walks").trials
    assert again.experiment == "locomotion"
    np.testing.assert_allclose(again.columns["displacement_head_mm"], walk.columns["displacement_head_mm"], atol=1e-3)


def test_a_trial_is_a_table_over_time(walk):
    pytest.importorskip("pandas")
    frame = walk.to_pandas()
    assert frame.index.name == "time_s"
    assert frame.attrs["experiment"] == "locomotion"
    np.testing.assert_array_equal(frame["displacement_head_mm"], walk.columns["displacement_head_mm"])
    both = Dataset(None, "walks", {}, (walk,)).to_pandas()
    assert both.index.names == ["file", "time_s"]


def test_a_trial_is_drawn_one_quantity_below_the_other(walk, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    figure = walk.plot()
    labels = [axis.get_ylabel() for axis in figure.axes]
    assert sorted(labels) == ["command", "displacement [mm]", "pressure [psi]"]
    assert figure.axes[-1].get_xlabel() == "time [s]"


def test_a_robot_has_the_speed_of_its_gait():
    assert bifa.Robot().speed_mm_s() == pytest.approx(10.83, abs=0.01)
    assert "nominal" in repr(bifa.Robot())
    for walked in (bifa.Robot().speed_mm_s, bifa.Robot().simulate):
        with pytest.raises(bifa.BifaError, match="at least one cycle, not 0"):
            walked(cycles=0)


HOST = Path(__file__).resolve().parent.parent


def test_every_name_at_the_front_doors_has_a_type(tmp_path):
    script = tmp_path / "theirs.py"
    names = [*(f"bifa.{name}" for name in bifa.__all__), *(f"lacuna.{name}" for name in lacuna.__all__)]
    answers = ["bifa.Robot().diagnose(bifa.load_dataset(''))", "bifa.Robot().optimize().gait"]
    asked = "".join(f"reveal_type({name})\n" for name in (*names, *answers))
    script.write_text(f"import bifa\nimport lacuna\n\n{asked}", encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", str(script)], cwd=HOST, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    revealed = [line for line in done.stdout.splitlines() if "Revealed type" in line]
    assert len(revealed) == len(names) + len(answers)
    assert not [line for line in revealed if line.endswith('"Any"')]


def test_both_packages_say_that_they_have_types():
    for package in (bifa, lacuna):
        assert (Path(package.__file__).parent / "py.typed").is_file()
