"""`import bifa` offers what a notebook needs, and imports its dependencies only when they are used."""

import subprocess
import sys

import numpy as np
import pytest

import bifa
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
