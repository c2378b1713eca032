"""What is typed or saved at the bench and is not this trial's record: said, and asked for again."""

import pytest

from bifa.measure.desk import Desk
from bifa.measure.own_instruments import OwnInstruments, Turn
from bifa.measure.plan import PlannedTrial


@pytest.fixture
def said():
    return []


@pytest.fixture
def instruments(said, tmp_path):
    own = OwnInstruments(Desk(said.append))
    own.begin(Turn(PlannedTrial("anchor_pull", None, 8.5, 20.0), 2, 2), tmp_path / "raw")
    own._experiment = "anchor_pull"
    return own


@pytest.mark.parametrize("typed", ["~nouser/x.csv", "x" * 400])
def test_a_path_that_cannot_be_is_no_file(instruments, said, typed):
    assert not instruments._take_named(typed)
    assert "There is no file" in said[-1]


def test_an_earlier_trials_record_is_refused(instruments, said, tmp_path):
    (tmp_path / "raw").mkdir()
    for path in (tmp_path / "raw" / "anchor_first.csv", tmp_path / "again.csv"):
        path.write_text("time_s,displacement_mm,force_N\n1,2,3\n2,3,4\n")
        path.with_suffix(".sync.csv").write_text("sync_time_s\n1\n2\n")
    assert not instruments._take_named(str(tmp_path / "again.csv"))
    assert "an earlier trial, anchor_first.csv" in said[-1]
