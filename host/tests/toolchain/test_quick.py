"""`make test ARGS=--quick` leaves out only slow and real-time tests; a full run starts with the slow tests."""

import subprocess
import sys

FILES = ("tests/toolchain/test_flash.py", "tests/toolchain/test_platformio_offline.py")


def collected(project, *options: str) -> list[str]:
    """Files of the tests that would run, in order."""
    command = [sys.executable, "-m", "pytest", "--collect-only", "-p", "no:cacheprovider", *options, *FILES]
    done = subprocess.run(command, cwd=project / "host", capture_output=True, text=True, check=True)
    return [line.split("::")[0] for line in done.stdout.splitlines() if "::" in line]


def test_the_quick_loop_leaves_out_what_is_slow_and_nothing_else(project):
    assert FILES[0] in (quick := collected(project, "--quick"))
    assert FILES[1] not in quick
    every = collected(project)
    assert every.count(FILES[0]) == quick.count(FILES[0])


def test_slow_tests_are_begun_first(project):
    assert set(collected(project)[:2]) == {FILES[1]}
