"""Run the Unity suites of one PlatformIO environment, and fail where PlatformIO would not notice.

PlatformIO calls a suite that printed no result "skipped" and is content; here each suite must pass at least one
test. It waits for ever for a chip that hangs or restarts again and again; here there is a limit.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent
PIO = Path(sys.executable).with_name("pio")
LIMIT_S = 1200


def main(environment: str) -> int:
    """Run the suites of `environment`; return 0 if every one passed, else 1."""
    report = PROJECT / "build" / f"unity-{environment}.json"
    report.parent.mkdir(exist_ok=True)
    report.unlink(missing_ok=True)
    try:
        if run_limited([PIO, "test", "-e", environment, "--json-output-path", report], LIMIT_S):
            return 1
    except subprocess.TimeoutExpired:
        print(f"error: the suites in {environment} did not end within {LIMIT_S} s; the last one hangs", file=sys.stderr)
        return 1
    complaints = unproven(json.loads(report.read_text()), environment)
    for complaint in complaints:
        print(f"error: {complaint}", file=sys.stderr)
    return 1 if complaints else 0


def run_limited(command: list, limit_s: float) -> int:
    """Run `command`; return its status. On TimeoutExpired or an interrupt no process of it is left behind."""
    with subprocess.Popen(command, cwd=PROJECT, start_new_session=True) as process:
        try:
            return process.wait(limit_s)
        except BaseException:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            raise


def unproven(report: dict, environment: str) -> list[str]:
    """Return one sentence for each suite of PlatformIO's JSON report that ran without passing a test."""
    run = [
        suite for suite in report["test_suites"] if suite["env_name"] == environment and suite["timestamp"] is not None
    ]
    if not run:
        return [f"no suite was run in environment {environment}"]
    return [f"suite {suite['test_name']} printed no result" for suite in run if suite["status"] != "PASSED"]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
