"""Only one program at a time works in a folder, and the others are told which."""

import errno
import json
import os
import signal
import subprocess
import sys

import pytest

from bifa.lock import LockedError, locked
from harness.full_disk import room_for

HOLD = """
import sys, time
from bifa.lock import locked
with locked(sys.argv[1]):
    print("held", flush=True)
    time.sleep(60)
"""


def lock_of(folder):
    return folder.with_name(f".{folder.name}.lock")


def test_the_second_is_told_who_the_first_is(tmp_path):
    folder = tmp_path / "campaign"
    with locked(folder):
        who = json.loads(lock_of(folder).read_text())
        assert who["pid"] == os.getpid()
        with pytest.raises(LockedError, match=f"process {os.getpid()} on .*since 20") as refused, locked(folder):
            pass
        assert who["command"].split()[0] in str(refused.value)
    assert not lock_of(folder).exists()
    assert not folder.exists()
    with locked(folder):
        pass


def test_what_a_killed_program_has_left_is_stale(tmp_path):
    folder = tmp_path / "campaign"
    holder = subprocess.Popen([sys.executable, "-c", HOLD, str(folder)], stdout=subprocess.PIPE)
    holder.stdout.readline()
    with pytest.raises(LockedError, match=f"process {holder.pid}"), locked(folder):
        pass
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    holder.stdout.close()
    assert lock_of(folder).exists()
    with locked(folder):
        assert json.loads(lock_of(folder).read_text())["pid"] == os.getpid()


def test_a_full_disk_is_told_with_the_folder(tmp_path):
    with room_for(10), pytest.raises(LockedError, match=r"/campaign cannot be written \(.*free some space"):
        locked(tmp_path / "campaign").__enter__()
    assert not list(tmp_path.iterdir())


def test_one_of_many_gets_it_and_each_in_turn(tmp_path):
    """Programs that acquire and release the lock continually never hold it at once, and all of them finish."""
    code = """
import os, sys, time
from bifa.lock import LockedError, locked
done = 0
while done < 30:
    try:
        with locked(sys.argv[1]):
            os.close(os.open(sys.argv[1] + ".inside", os.O_CREAT | os.O_EXCL))
            time.sleep(0.001)
            os.unlink(sys.argv[1] + ".inside")
            done += 1
    except LockedError:
        time.sleep(0.001)
"""
    command = [sys.executable, "-c", code, str(tmp_path / "campaign")]
    programs = [subprocess.Popen(command) for _ in range(4)]
    assert [program.wait(120) for program in programs] == [0] * 4


@pytest.mark.parametrize("left", ["", "{", "null", '{"pid": 1}'])
def test_a_lock_that_says_nothing_is_taken_over(tmp_path, left):
    folder = tmp_path / "campaign"
    lock_of(folder).write_text(left)
    with locked(folder):
        pass


def test_where_nothing_can_be_locked_nobody_is_blamed(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(pytest.importorskip("fcntl"), "flock", refuse)
    with pytest.raises(LockedError, match=r"locked \(No locks available\); choose another"), locked(tmp_path / "day"):
        pass
