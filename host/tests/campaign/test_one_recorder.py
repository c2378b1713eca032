"""A walk is the same trial whichever command recorded it."""

import pytest

from bifa.campaign.walks import measure_walks
from bifa.data import read_dataset
from bifa.live.record import record_walks
from bifa.measure.plan import BASELINE, PlannedTrial
from bifa.measure.session import run_session
from bifa.rig import open_rig
from bifa.screen import Console


@pytest.mark.uno
def test_bifa_record_an_experiment_and_a_campaign_note_the_same(tmp_path):
    planned = (PlannedTrial("locomotion", gait=BASELINE, cycles=1),)
    record = {
        "record": lambda rig, out: record_walks(rig, "virtual", out, None, 1, 1, Console(quiet=True)),
        "experiment": lambda rig, out: run_session(rig, out, planned, name="a day", known={}, provenance={}),
        "campaign": lambda rig, out: measure_walks(rig, out, {"baseline": BASELINE}, 1),
    }
    sets = {}
    for name, recorded in record.items():
        with open_rig("virtual", profile="ideal", seed=3) as rig:
            recorded(rig, tmp_path / name)
        sets[name] = read_dataset(tmp_path / name)
    first = sets["record"].trials[0]
    assert first.extra["set_point_psi"] == pytest.approx(8.47, abs=0.01)
    for dataset in sets.values():
        (trial,) = dataset.trials
        assert (trial.condition, trial.session_order, trial.extra) == (first.condition, 1, first.extra)
        assert {name: values.tolist() for name, values in trial.columns.items()} == {
            name: values.tolist() for name, values in first.columns.items()
        }
        assert "firmware" in dataset.provenance
