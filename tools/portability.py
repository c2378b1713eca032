"""Run the tests as on other machines: other linear algebra, instructions, locale, home, test order, cores.

    make portability                                    the numerical tests in every environment
    make portability ARGS="--only turkish --whole"      every test in one of them, the Unity suites included
    make portability ARGS="--only old -- -k settle -x"  what follows -- is pytest's
    make portability ARGS=--another-blas                the estimation's tests, linear algebra unlike this machine's
    make portability ARGS=--list

Each environment combines several differences, since a run costs minutes. One line per environment at the end tells the
outcome. What no variable can set (a checkout in a folder with spaces) is run by hand, see docs/building.md.
"""

import argparse
import json
import os
import platform
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

PROJECT = Path(__file__).resolve().parent.parent
BUILD = PROJECT / "build" / "portability"
NUMERICAL = ("lacuna", "robot", "simulate", "measure", "identify", "problem", "gait", "campaign", "report")
ESTIMATION = ("lacuna", "identify")  # the most sensitive to linear algebra; short enough for every commit
NO_TESTS_RAN = 5  # pytest's exit status

# OpenBLAS's kernels, and the instructions that each requires. NumPy's and SciPy's wheels contain only a few, and use
# these for similar processors: Haswell for Zen.
KERNELS = {"Nehalem": "SSE42", "Haswell": "AVX2", "SkylakeX": "AVX512_SKX"}
ALIKE = {"Zen": "Haswell", "Cooperlake": "SkylakeX", "SapphireRapids": "SkylakeX"}

# Run in the environment to verify it: a variable that is ignored must not pass for another machine.
PROBE = """
import json, locale, os, tempfile, time
import numpy, scipy.linalg, threadpoolctl
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
try:
    language = locale.setlocale(locale.LC_ALL, "")
except locale.Error:
    language = "unknown"
def writable(folder):  # os.access would always say yes to root
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False
def compiled_for():
    if "NUMBA_CPU_NAME" in os.environ:  # else not worth the second that the import takes
        from numba import config
        return config.CPU_NAME
blas = sorted({i.get("architecture") for i in threadpoolctl.threadpool_info() if i["user_api"] == "blas"}, key=str)
print(json.dumps({
    "blas": blas,
    "instructions": [name for name in __cpu_dispatch__ if __cpu_features__[name]],
    "locale": language,
    "zone": time.tzname[0],
    "compiled for": compiled_for(),
    "home": "writable" if writable(os.path.expanduser("~")) else "not writable",
    "cores": len(os.sched_getaffinity(0)),
}))
"""


@dataclass(frozen=True)
class Environment:
    """`variables` are set; `expected` is what the probe must then report. `plain`: numpy without the instructions that
    it selects at run time."""

    name: str
    text: str
    kernel: str | None = None
    variables: dict[str, str] = field(default_factory=dict)
    expected: dict[str, object] = field(default_factory=dict)
    plain: bool = False
    cores: int | None = None


ENVIRONMENTS = (
    Environment(
        "turkish",
        "BLAS Haswell, locale tr_TR.UTF-8, time zone Asia/Kathmandu, tests in another order",
        "Haswell",
        {"LC_ALL": "tr_TR.UTF-8", "TZ": "Asia/Kathmandu", "BIFA_TEST_ORDER": "1"},
        {"locale": "tr_TR.UTF-8", "zone": "+0545"},
    ),
    Environment(
        "bare",
        "BLAS Nehalem, numpy without AVX2 and AVX-512, locale C, a home that cannot be written",
        "Nehalem",
        {"LC_ALL": "C", "HOME": "/proc"},  # which even root cannot write to
        {"locale": "C", "instructions": [], "home": "not writable"},
        plain=True,
    ),
    Environment(
        "old",
        "BLAS Haswell, numba for any x86-64 (no fused multiply-add), one core",
        "Haswell",
        {"NUMBA_CPU_NAME": "generic", "BIFA_CACHE_DIR": str(BUILD / "generic")},
        {"compiled for": "generic", "cores": 1},
        cores=1,
    ),
    Environment("server", "BLAS SkylakeX", "SkylakeX"),
)


class RefusedError(Exception):
    """This machine cannot imitate that environment."""


class IgnoredError(Exception):
    """A variable had no effect, so a pass would prove nothing."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the tests in the chosen environments; return 0 if all passed in each that this machine can imitate."""
    chosen = _arguments(arguments)
    if chosen.list:
        print("\n".join(f"{e.name:8}  {e.text}" for e in ENVIRONMENTS))
        return 0
    environments = [e for e in ENVIRONMENTS if not chosen.only or e.name in chosen.only]
    if chosen.another_blas:
        environments = [another_blas()]
    folders = ESTIMATION if chosen.another_blas else NUMERICAL
    tests = [] if chosen.whole else [f"tests/{folder}" for folder in folders]
    lines, failed = [], False
    for environment in environments:
        status, line = run(environment, [*tests, *chosen.pytest], unity=chosen.whole)
        failed |= bool(status)
        lines.append(line)
    print("", *lines, sep="\n", file=sys.stderr if failed else sys.stdout)
    return int(failed)


def _arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="make portability", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", action="append", choices=[e.name for e in ENVIRONMENTS], help="may be repeated")
    parser.add_argument("--whole", action="store_true", help="every test, not just numerical ones, and Unity suites")
    parser.add_argument("--another-blas", action="store_true", help="only estimation, with other linear algebra")
    parser.add_argument("--list", action="store_true", help="list the environments")
    parser.add_argument("pytest", nargs="*", help=argparse.SUPPRESS)
    return parser.parse_args(arguments)


def another_blas(probed: dict | None = None) -> Environment:
    """The environment that differs from this machine only in the kernels of its linear algebra."""
    own = {ALIKE.get(kernel, kernel) for kernel in (probed or probe({**os.environ}))["blas"]}
    able = features()["features"]
    others = [name for name in ("Haswell", "Nehalem", "SkylakeX") if name not in own and KERNELS[name] in able]
    kernel = (others or ["Nehalem"])[0]  # if none is available, `settings` says so
    return Environment("another BLAS", f"BLAS {kernel} in place of {', '.join(map(str, sorted(own, key=str)))}", kernel)


def run(environment: Environment, tests: Sequence[str], *, unity: bool) -> tuple[int, str]:
    """Run pytest there, and the native Unity suites if `unity`; return a status, 0 if all passed, and one line."""
    begun = _processor_s()
    try:
        variables, cores = settings(environment)
    except RefusedError as refusal:
        return 0, f"portability: {environment.name:12}  not run: {refusal}"
    except IgnoredError as ignored:
        return 1, f"portability: {environment.name:12}  FAILED: {ignored}"
    print(f"== {environment.name}: {environment.text} ==", flush=True)

    def limited() -> None:
        os.sched_setaffinity(0, cores)

    workers = ["-n", str(len(cores))] if len(cores) > 1 else ["-n", "0"]
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *workers, *tests]
    options = {"env": variables, "preexec_fn": limited, "check": False}
    status = subprocess.run(command, cwd=PROJECT / "host", **options).returncode
    text = {0: "passed", NO_TESTS_RAN: "no tests were run"}.get(status, "FAILED")
    if unity:
        suites = subprocess.run([sys.executable, PROJECT / "tools" / "unity_suites.py", "native"], **options).returncode
        text += ", Unity suites " + ("FAILED" if suites else "passed")
        status = status or suites
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "ran").touch()  # .ci/run then runs these tests in no other environment
    spent = _processor_s() - begun
    return status, f"portability: {environment.name:12}  {text}, {spent:.0f} s of processor  ({environment.text})"


def settings(environment: Environment) -> tuple[dict[str, str], set[int]]:
    """The variables and cores that make this machine imitate that one; RefusedError if that is not possible."""
    BUILD.mkdir(parents=True, exist_ok=True)
    variables = {**os.environ, **environment.variables}
    cores = set(sorted(os.sched_getaffinity(0))[: environment.cores])
    if platform.machine() not in ("x86_64", "AMD64"):
        raise RefusedError(f"the kernels chosen are those of x86-64, this is {platform.machine()}")
    here = features()
    if environment.kernel:
        needed = KERNELS[environment.kernel]
        if needed not in here["features"]:
            raise RefusedError(f"this machine has no {needed}, which BLAS's {environment.kernel} needs")
        variables["OPENBLAS_CORETYPE"] = environment.kernel
    if environment.plain:
        known = os.environ.get("NPY_DISABLE_CPU_FEATURES", "").split()  # set if this is run within such an environment
        variables["NPY_DISABLE_CPU_FEATURES"] = " ".join([*known, *(set(here["dispatched"]) & set(here["features"]))])
    language = environment.variables.get("LC_ALL", "C")
    if language != "C":
        variables["LOCPATH"] = str(_locale(language))
    expected = {"blas": [environment.kernel], **environment.expected}
    found = probe(variables, cores)
    wrong = {name: found[name] for name, value in expected.items() if found[name] != value}
    if wrong:
        raise IgnoredError(f"asked for {dict((n, expected[n]) for n in wrong)}, got {wrong}")
    return variables, cores


def probe(variables: dict[str, str], cores: set[int] | None = None) -> dict:
    """Report of an interpreter started with these variables and cores."""
    limit = (lambda: os.sched_setaffinity(0, cores)) if cores else None
    done = subprocess.run(
        [sys.executable, "-c", PROBE], env=variables, preexec_fn=limit, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RefusedError(done.stderr.strip().splitlines()[-1])
    return json.loads(done.stdout)


def features() -> dict[str, list[str]]:
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    return {"features": [name for name, there in __cpu_features__.items() if there], "dispatched": __cpu_dispatch__}


def _locale(name: str) -> Path:
    """A folder containing the locale, compiled there, since installing it would need privileges."""
    made = BUILD / "locales" / name
    if not made.exists():
        made.parent.mkdir(exist_ok=True)
        language, _, charset = name.partition(".")
        try:
            done = subprocess.run(["localedef", "-i", language, "-f", charset, made], capture_output=True, check=False)
        except FileNotFoundError as missing:
            raise RefusedError(f"the locale {name} needs localedef") from missing
        if not made.exists():
            raise RefusedError(
                f"the locale {name} cannot be made (Debian: apt install locales): {done.stderr.decode()}"
            )
    return made.parent


def _processor_s() -> float:
    used = getrusage(RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    sys.exit(main())
