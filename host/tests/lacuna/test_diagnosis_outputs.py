"""What a diagnosis is handed on as: a page, and an exit status where the input is unusable."""

import subprocess
import sys

from toy import hide

from lacuna.diagnosis.diagnose import diagnose
from lacuna.diagnosis.record import as_record
from lacuna.report.diagnosis import diagnosis_page
from lacuna.report.page import render


def test_page_says_the_effect_and_loads_nothing():
    record = as_record(diagnose(hide({"delay.delay_s": 0.02}, seed=30)))
    page = render(diagnosis_page("toy", record))
    assert "delay" in page
    assert "that the model does not explain: position_mm in sweep" in page
    assert 'src="http' not in page


def test_page_shows_what_was_learnt_where_no_effect_explains_the_data():
    record = as_record(diagnose(hide({"cubic_spring.stiffness_N_m3": 2000.0}, seed=15, withhold=["cubic_spring"])))
    (curve,) = record["learnt"]
    assert curve["term"] in render(diagnosis_page("toy", record))
    assert curve["rows"][""][-1] * curve["rows"][""][0] < 0.0


def test_unusable_input_ends_with_status_2(tmp_path):
    command = [sys.executable, "-c", "from bifa.cli import main; main()", "diagnose", str(tmp_path / "nothing")]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert ended.returncode == 2
    assert "does not exist" in " ".join(ended.stderr.replace("│", " ").split())
