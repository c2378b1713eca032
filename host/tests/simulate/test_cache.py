"""Compiled code is kept, and never older than its sources."""

import subprocess
import sys

from bifa.simulate import entries, generated

_SECOND_START = """
from bifa import robot, simulate
from bifa.simulate import lanes
from bifa.simulate.entries import entries
lanes.kernels = lambda: None
simulate.speed(robot.nominal(), robot.BASELINE, 2)
simulate.walk(robot.nominal(), robot.BASELINE, 1)
for entry in (entries.progress_record, entries.walk_record):
    assert sum(entry.stats.cache_hits.values()) == 1, entry
    assert not entry.stats.cache_misses, entry
"""


def test_a_second_start_compiles_nothing():
    first = [sys.executable, "-c", _SECOND_START.split("for entry")[0]]
    subprocess.run(first, check=True)
    subprocess.run([sys.executable, "-c", _SECOND_START], check=True)


def test_a_changed_source_gets_another_file(tmp_path, monkeypatch):
    monkeypatch.setenv("BIFA_CACHE_DIR", str(tmp_path))
    one = generated.load("sample", "value = 1\n")
    again = generated.load("sample", "value = 1\n")
    two = generated.load("sample", "value = 2\n")
    assert (one.value, again, two.value) == (1, one, 2)
    assert len(list(tmp_path.glob("bifa_sample_*.py"))) == 2


def test_the_entries_name_depends_on_every_compiled_source():
    sources = "".join(entries._sources())
    for told in ("def march(", "def step(", "def pressure_after(", "Dahl's equation", "def static_record("):
        assert told in sources
    assert entries.entries.__name__.endswith(generated.digest(entries._entry_source()))
