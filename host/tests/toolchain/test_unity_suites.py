"""A Unity suite that printed nothing must not count as passed."""

import os
import select
import subprocess

import pytest
from unity_suites import finding, run_limited, unproven


def report(*suites):
    return {
        "test_suites": [
            {"env_name": environment, "test_name": name, "status": status, "timestamp": when}
            for environment, name, status, when in suites
        ]
    }


PASSED, NOT_RUN = ("native", "test_a", "PASSED", "now"), ("native", "test_c", "SKIPPED", None)
ELSEWHERE = ("uno", "test_a", "SKIPPED", "now")


@pytest.mark.parametrize(
    ("suites", "told"),
    [
        ([PASSED, NOT_RUN, ELSEWHERE], []),
        ([PASSED, ("native", "test_b", "SKIPPED", "now")], ["suite test_b printed no result"]),
        ([NOT_RUN, ELSEWHERE], ["no suite was run in environment native"]),
    ],
    ids=["passed", "silent", "none"],
)
def test_a_suite_that_printed_nothing_is_named_and_none_at_all_is_an_error(suites, told):
    assert unproven(report(*suites), "native") == told


def test_a_hanging_chip_is_stopped_with_all_its_processes(tmp_path):
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    try:
        with pytest.raises(subprocess.TimeoutExpired):
            run_limited(["sh", "-c", f"sh -c 'echo started; exec sleep 600' > {fifo} & wait"], limit_s=5.0)
        assert os.read(reader, 100) == b"started\n"
        [closed], _, _ = select.select([reader], [], [], 60)
        assert os.read(closed, 100) == b"", "the grandchild still holds its output open"
    finally:
        os.close(reader)


def test_the_status_of_platformio_is_passed_on():
    assert run_limited(["sh", "-c", "exit 3"], limit_s=60) == 3


ADDRESS = """=================================================================
==20153==ERROR: AddressSanitizer: global-buffer-overflow on address 0x55da83e46782 at pc 0x55da83e41c51
READ of size 1 at 0x55da83e46782 thread T0
    #0 0x55da83e41c50 in bifa::flash_byte(void const*) lib/flash/flash.h:30
    #1 0x55da83e41c50 in bifa::sine(unsigned short) lib/cpg/sine.h:22
"""
UNDEFINED = """lib/cpg/sine.h:22:31: runtime error: signed integer overflow: 1 + 1 cannot be represented
    #0 0x55 in bifa::sine(unsigned short) lib/cpg/sine.h:22
"""


def test_what_a_sanitizer_found_is_named_with_its_place_and_without_one_it_is_still_told():
    assert finding(ADDRESS) == (
        "AddressSanitizer: global-buffer-overflow in bifa::flash_byte(void const*) lib/flash/flash.h:30"
    )
    assert finding(UNDEFINED).startswith("signed integer overflow: 1 + 1 cannot be represented in")
    assert "lib/cpg/sine.h:22" in finding(UNDEFINED)
    assert finding("garbage") == "a sanitizer stopped a suite in an unknown place"
