"""The workers of a search: the same results whoever computes them, and no process left behind."""

import errno
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import active_children
from threading import Event

import pytest

from lacuna.diagnosis.workers import Workers
from lacuna.estimation.problem import in_parallel, use_threads

NAMES = [("one",), ("two",), ("three",)]
JOBS = [(1,), (2,), (3,)]


@pytest.fixture(autouse=True)
def cores():
    """Two cores, or as many as a test asks for."""
    use_threads(2)
    yield use_threads
    use_threads(None)


@pytest.mark.parametrize("count", [1, 2])
def test_results_come_in_the_order_of_the_items_whatever_is_begun_first(cores, count):
    cores(count)
    assert in_parallel(lambda x: x * x, (3, 1, 2), work=(1.0, 3.0, 2.0)) == [9, 1, 4]
    assert in_parallel(str, [], work=[]) == []


def test_what_is_most_work_is_begun_first():
    begun, second = [], Event()

    def note(item: str) -> None:
        begun.append(item)
        if item == "long":
            assert second.wait(10.0)  # meanwhile the other thread does the rest
        if len(begun) == 3:
            second.set()

    in_parallel(note, ("short", "middle", "long"), work=(1.0, 2.0, 3.0))
    assert begun == ["long", "middle", "short"]


def test_children_answer_in_order_what_need_not_be_shipped():
    said = []
    found = Workers(said.append, forks=True).map("trying", NAMES, lambda x: (10 * x, os.getpid()), JOBS)
    assert [value for value, _ in found] == [10, 20, 30]
    assert os.getpid() not in {pid for _, pid in found}
    assert said == ["trying one", "trying two", "trying three"]
    assert not active_children()


@pytest.mark.parametrize(("count", "jobs", "forks"), [(1, JOBS, True), (2, JOBS[:1], True), (2, JOBS, False)])
def test_one_core_or_one_job_needs_no_children_and_a_system_may_forbid_them(cores, count, jobs, forks):
    cores(count)
    found = Workers(lambda _: None, forks=forks).map("trying", NAMES[: len(jobs)], lambda _: os.getpid(), jobs)
    assert set(found) == {os.getpid()}


def test_where_children_cannot_be_synchronized_there_are_none(monkeypatch):
    """As without a writable /dev/shm."""

    def refuse(*_):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr("_multiprocessing.SemLock", refuse)
    found = Workers(lambda _: None, forks=True).map("trying", NAMES, lambda _: os.getpid(), JOBS)
    assert set(found) == {os.getpid()}


def test_an_executor_is_preferred_to_children():
    with ThreadPoolExecutor(2) as pool:
        found = Workers(lambda _: None, pool, forks=True).map("trying", NAMES, lambda _: os.getpid(), JOBS)
    assert set(found) == {os.getpid()}


def test_what_goes_wrong_in_a_child_is_said():
    with pytest.raises(ZeroDivisionError):
        Workers(lambda _: None, forks=True).map("trying", NAMES, lambda x: 1 // (x - 2), JOBS)
    assert not active_children()


def test_an_interruption_leaves_no_child_at_work():
    def interrupted(_: str) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Workers(interrupted, forks=True).map("trying", NAMES, lambda _: time.sleep(3600.0), JOBS)
    assert not active_children()


def test_children_do_not_outlive_a_parent_that_is_killed():
    begun = subprocess.Popen([sys.executable, "-c", _FOREVER], stdout=subprocess.PIPE, text=True)
    children = [int(begun.stdout.readline()) for _ in range(2)]
    begun.kill()
    begun.wait()
    begun.stdout.close()
    deadline = time.monotonic() + 20.0
    while any(map(_alive, children)):
        assert time.monotonic() < deadline
        time.sleep(0.05)


_FOREVER = """
import os, time
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.problem import use_threads

def job(_):
    os.write(1, f"{os.getpid()}\\n".encode())
    time.sleep(3600.0)

use_threads(2)
Workers(lambda _: None, forks=True).map("trying", [("one",), ("two",)], job, [(1,), (2,)])
"""


def _alive(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as stat:
            return stat.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False
