"""A campaign's progress fits terminals of any width without being cut off."""

import io
import re
from contextlib import closing

import pytest

from bifa.campaign.progress import StageProgress
from bifa.campaign.stages import Stage
from bifa.screen import Console

STAGE = Stage("measure", "characterise the robot on its bench", (), (), lambda inputs, outputs: None)


@pytest.mark.parametrize("width", [60, 80, 120, 200])
def test_what_the_stage_does_is_not_cut_off(width):
    out = io.StringIO()
    with closing(StageProgress(Console(file=out, width=width, force_terminal=True, color_system=None))) as progress:
        progress.start(STAGE)
        progress.update("static loading, small, 8 psi, 2 mm/s, repeat 1", 0.4)
        progress.end(STAGE, ran=True)
    seen = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", out.getvalue()).replace("\r", "\n")
    assert "…" not in seen
    assert "done" in seen
    assert max(map(len, seen.splitlines())) <= width
