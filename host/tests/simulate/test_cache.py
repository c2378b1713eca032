"""Compiled code is cached, and never older than its sources."""

import errno
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from bifa.errors import BifaError
from bifa.files import TargetError
from bifa.simulate import entries, generated
from bifa.simulate.lanes import program
from harness.full_disk import room_for

_SECOND_START = """
from bifa import robot, simulate
from bifa.simulate import lanes
from bifa.simulate.entries import entries
lanes.kernels = lambda: None
simulate.speed(robot.nominal(), robot.BASELINE, 2)
simulate.walk(robot.nominal(), robot.BASELINE, 1)
assert sum(entries.walk_record.stats.cache_hits.values()) == 1
assert not entries.walk_record.stats.cache_misses
"""
CACHED = "from numba import njit\n\n\n@njit(cache=True)\ndef one():\n    return 1\n"


def test_a_second_start_compiles_nothing():
    first = [sys.executable, "-c", _SECOND_START.split("assert")[0]]
    subprocess.run(first, check=True)
    subprocess.run([sys.executable, "-c", _SECOND_START], check=True)


def test_a_changed_source_gets_another_file(tmp_path, monkeypatch):
    monkeypatch.setenv("BIFA_CACHE_DIR", str(tmp_path))
    one = generated.load("sample", "value = 1\n")
    again = generated.load("sample", "value = 1\n")
    two = generated.load("sample", "value = 2\n")
    assert (one.value, again, two.value) == (1, one, 2)
    assert len(list(tmp_path.glob("bifa_sample_*.py"))) == 2


def test_a_full_disk_is_named(no_cache):
    with room_for(100), pytest.raises(TargetError, match=r"bifa_sample_\w+\.py cannot be written"):
        generated.load("sample", "value = 1" + 100 * " " + "\n")
    assert not list(no_cache.rglob("*.*"))


@pytest.mark.parametrize("why", ["ENOSPC", "EDQUOT", "EROFS", "EACCES"])
@pytest.mark.parametrize("refused", ["any file", "a large file"])
def test_code_that_the_cache_does_not_take_lives_in_the_temporary_folder(no_cache, tmp_path, monkeypatch, refused, why):
    monkeypatch.setenv("BIFA_CACHE_DIR", cache := str(tmp_path / "cache"))
    owner, name = (tempfile, "TemporaryFile") if refused == "any file" else (Path, "write_bytes")
    real = getattr(owner, name)

    def refuse(*arguments, **options):
        if cache in str(options or arguments):
            raise OSError(getattr(errno, why), os.strerror(getattr(errno, why)))
        return real(*arguments, **options)

    monkeypatch.setattr(owner, name, refuse)
    module = generated.load(f"sample_{owner.__name__}_{why}", CACHED)
    assert no_cache in Path(module.__file__).parents
    assert module.one() == 1
    assert list(Path(module.__file__).parent.glob(f"__pycache__/{module.__name__}*.nbc"))


def test_code_that_cannot_be_kept_is_compiled_at_each_start(tmp_path, monkeypatch):
    monkeypatch.setenv("BIFA_CACHE_DIR", str(tmp_path))
    module = generated.load("unkept", CACHED)
    shutil.rmtree(tmp_path / "__pycache__")
    (tmp_path / "__pycache__").write_text("numba can make no folder here")
    assert module.one() == 1


@pytest.mark.parametrize("empty", ["__pycache__/*.nbi", "__pycache__/*.nbc"])
def test_a_file_of_numba_that_a_power_cut_left_empty_is_written_again(tmp_path, monkeypatch, empty):
    monkeypatch.setenv("BIFA_CACHE_DIR", str(tmp_path))
    for _ in range(2):
        module = generated.load("sample", CACHED)
        assert module.one() == 1
        del sys.modules[module.__name__]
        (path,) = tmp_path.glob(empty)
        path.write_bytes(b"")


def test_the_entries_name_depends_on_every_compiled_source():
    sources = "".join(entries.sources())
    for told in ("def march(", "def step(", "def pressure_after(", "Dahl's equation", "def static_record("):
        assert told in sources
    assert entries.entries.__name__.endswith(generated.digest(entries.entry_source()))


def test_the_code_is_the_same_where_numba_compiles_nothing():
    """NUMBA_DISABLE_JIT=1 is for debugging: numba's decorators then return the functions themselves."""
    told = "from bifa.simulate import entries; from bifa.simulate.lanes import program; "
    told += "print(entries.entry_source() + program.source())"
    command, environ = [sys.executable, "-c", told], {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, env=environ, capture_output=True, text=True, encoding="utf-8", check=True)
    assert done.stdout == entries.entry_source() + program.source() + "\n"


@pytest.fixture
def no_cache(tmp_path, monkeypatch) -> Path:
    """The folder of temporary files, on a computer whose cache cannot be written."""
    (tmp_path / "file").write_text("")
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("BIFA_CACHE_DIR", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    generated.temporary_folder.cache_clear()
    yield tmp_path / "tmp"
    generated.temporary_folder.cache_clear()


def _privately(folder: Path) -> bool:
    return folder.is_dir() and folder.stat().st_mode & 0o777 == 0o700


@pytest.fixture
def no_home(no_cache, monkeypatch):
    """As in containers: neither HOME nor an entry in /etc/passwd."""

    def refuse():
        raise RuntimeError("Could not determine home directory.")

    for name in ("BIFA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", refuse)


def test_without_a_home_directory_code_lives_in_the_temporary_folder(no_cache, no_home):
    assert generated.folder().parent == no_cache


def test_without_any_folder_the_error_says_what_to_set(no_cache, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(no_cache / "missing"))
    with pytest.raises(BifaError, match="set BIFA_CACHE_DIR"):
        generated.folder()


def test_without_a_cache_code_lives_in_a_private_temporary_folder(no_cache):
    folder = generated.folder()
    assert folder.parent == no_cache
    assert _privately(folder)
    generated.temporary_folder.cache_clear()
    assert generated.folder() == folder, "another process finds what was compiled"


@pytest.mark.parametrize("is_link", [False, True])
def test_code_is_not_taken_from_a_temporary_folder_that_others_may_write_or_lead_elsewhere(no_cache, tmp_path, is_link):
    planted = generated.folder()
    if is_link:
        planted.rename(tmp_path / "private")
        planted.symlink_to(tmp_path / "private")
    else:
        planted.chmod(0o777)
    generated.temporary_folder.cache_clear()
    assert generated.folder() != planted
    assert _privately(generated.folder())
    assert generated.folder() == generated.folder()


def test_what_fails_as_it_is_loaded_is_not_taken_for_loaded(tmp_path, monkeypatch):
    monkeypatch.setenv("BIFA_CACHE_DIR", str(tmp_path))
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            generated.load("broken", "value = 1 / 0\n")
