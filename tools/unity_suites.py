"""Run the Unity suites of one PlatformIO environment, and fail where PlatformIO would not notice.

PlatformIO calls a suite that printed no result "skipped" and succeeds; here each suite must pass at least one test. It
waits forever for a chip that hangs or keeps restarting; here there is a time limit. It reports a sanitizer's finding as
a signal that never occurred; here the sanitizer's report is kept and its first lines are shown.
"""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

PROJECT = Path(__file__).resolve().parent.parent
PIO = Path(sys.executable).with_name("pio")
LIMIT_S = 1200
SANITIZER_REPORTS = PROJECT / "build" / "sanitizer"
NO_SIGNAL = 99  # PlatformIO mistakes a status of 1 for SIGHUP


def main(environment: str) -> int:
    """Run the suites of `environment`; return 0 if every one passed, else 1."""
    report = PROJECT / "build" / f"unity-{environment}.json"
    report.parent.mkdir(exist_ok=True)
    report.unlink(missing_ok=True)
    for old in sanitizer_reports():
        old.unlink()
    try:
        failed = run_limited([PIO, "test", "-e", environment, "--json-output-path", report], LIMIT_S)
    except subprocess.TimeoutExpired:
        print(f"error: the suites in {environment} did not end within {LIMIT_S} s; the last one hangs", file=sys.stderr)
        return 1
    complaints = [f"{finding(path.read_text())}; whole report in {path}" for path in sanitizer_reports()]
    if not failed:
        complaints += unproven(json.loads(report.read_text()), environment)
    for complaint in complaints:
        print(f"error: {complaint}", file=sys.stderr)
    return 1 if failed or complaints else 0


def sanitizer_reports() -> list[Path]:
    """The sanitizers' reports; they append the process id to the name."""
    return sorted(SANITIZER_REPORTS.parent.glob(f"{SANITIZER_REPORTS.name}.*"))


def finding(report: str) -> str:
    """Summary of a sanitizer's report: what happened, and the first place in the project."""
    what = re.search(r"(?:ERROR: |runtime error: )(.+?)(?: on address.*)?$", report, re.MULTILINE)
    where = re.search(r"in (\S.*? (?:lib|test)/\S+)|^((?:lib|test)/[^:]+:\d+)", report, re.MULTILINE)
    place = next((group for group in where.groups() if group), "?") if where else "an unknown place"
    return f"{what[1] if what else 'a sanitizer stopped a suite'} in {place}"


def run_limited(command: list, limit_s: float) -> int:
    """Run `command`; return its status. On TimeoutExpired or an interrupt, no process of it is left running."""
    options = f"log_path={SANITIZER_REPORTS}:exitcode={NO_SIGNAL}:print_stacktrace=1"
    environment = os.environ | {"ASAN_OPTIONS": options, "UBSAN_OPTIONS": options}
    with subprocess.Popen(command, cwd=PROJECT, env=environment, start_new_session=True) as process:
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
