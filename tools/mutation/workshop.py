"""Build the Unity suites once, then repeatedly with one file changed, recompiling only what depends on it."""

import math
import os
import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

from mutation.mutants import Mutant

PROJECT = Path(__file__).resolve().parents[2]
BUILD = PROJECT / "build" / "mutation"
COMPILER = os.environ.get("CXX", "g++")
# As in platformio.ini; the sanitizer finds mutants that only cause undefined behaviour.
FLAGS = (
    *("-std=gnu++11", "-O0", "-w", "-DUNITY_SUPPORT_64", "-DUNITY_INCLUDE_DOUBLE", "-DDECIMAL_DIG=__DECIMAL_DIG__"),
    *("-Werror=return-type", "-fsanitize=undefined,bounds-strict", "-fno-sanitize-recover=all"),
)
# The suites on this computer cannot test all of the guard; this test does, by reading the chip's instructions.
ON_THE_CHIP = Path("host/tests/firmware/test_critical.py")
ONLY_ON_THE_CHIP = Path("lib/critical/critical.h")


@dataclass
class Suite:
    """One Unity suite: its sources with the files that each depends on, and how long it runs."""

    name: str
    sources: dict[Path, frozenset[Path]] = field(default_factory=dict)
    seconds: float = 0.0

    def depends_on(self, file: Path) -> bool:
        return any(file in parts for parts in self.sources.values())


class Workshop:
    """A copy of the sources in which mutants are built and run one at a time."""

    def __init__(self, name: str) -> None:
        self.folder = BUILD / name
        shutil.rmtree(self.folder, ignore_errors=True)
        for part in ("lib", "test", "host/tests/firmware"):
            shutil.copytree(
                PROJECT / part, self.folder / part, ignore=shutil.ignore_patterns("__pycache__", "conftest.py")
            )
        (self.folder / "objects").mkdir()
        self._program = self.folder / "suite"
        self.includes = [f"-I{_unity()}", *(f"-I{folder}" for folder in sorted((self.folder / "lib").iterdir()))]
        self.suites: list[Suite] = []
        self.kills: Counter[tuple[Path, str]] = Counter()

    def build(self, files: Collection[Path]) -> None:
        """Build the unchanged suites that depend on any of `files`; RuntimeError if one does not pass."""
        units = [path.relative_to(self.folder) for path in sorted(self.folder.glob("lib/*/*.cpp"))]
        parts = {unit: self._compile(unit) for unit in units}
        self._run(
            [COMPILER, "-x", "c", *FLAGS[1:], *self.includes, "-c", _unity() / "unity.c", "-o", self._object("unity")]
        )
        mains = sorted(path.relative_to(self.folder) for path in self.folder.glob("test/**/main.cpp"))
        for main in mains:
            suite = Suite(str(main.parent.relative_to("test")), {main: self._compile(main)})
            suite.sources |= {unit: parts[unit] for unit in self._linked(main, units)}
            if not any(suite.depends_on(file) for file in files):
                continue
            begin = time.monotonic()
            if complaint := self._passes(suite, 600):
                raise RuntimeError(f"{suite.name}: {complaint}")
            suite.seconds = time.monotonic() - begin
            self.suites.append(suite)
        self.suites.sort(key=lambda suite: suite.seconds)

    def verdict(self, mutant: Mutant) -> str:
        """Build and run a mutant; return "killed", "survived" or "does not compile"."""
        file = Path(mutant.file)
        path = self.folder / file
        source = path.read_text()
        path.write_text(mutant.applied(source))
        try:
            return self._tried(file)
        finally:
            path.write_text(source)

    def _tried(self, file: Path) -> str:
        changed: dict[Path, Path] = {}
        concerned = [suite for suite in self.suites if suite.depends_on(file)]
        # The one that has killed most of this file's mutants comes first, then the quickest.
        for suite in sorted(concerned, key=lambda suite: -self.kills[file, suite.name]):
            for unit, parts in suite.sources.items():
                if file not in parts or unit in changed:
                    continue
                changed[unit] = self._object(unit).with_suffix(".changed")
                if not self._compiles(unit, changed[unit]):
                    return "does not compile"
            if self._passes(suite, 2 + 3 * suite.seconds, changed):
                self.kills[file, suite.name] += 1
                return "killed"
        if file == ONLY_ON_THE_CHIP and not self._passes_on_the_chip():
            return "killed"
        return "survived"

    def _passes_on_the_chip(self) -> bool:
        options = ["-q", "-x", "-p", "no:cacheprovider", "-c", os.devnull, "--rootdir", "."]
        command = [sys.executable, "-m", "pytest", *options, ON_THE_CHIP]
        return subprocess.run(command, cwd=self.folder, capture_output=True).returncode == 0

    def _passes(self, suite: Suite, limit_s: float, changed: dict[Path, Path] | None = None) -> str:
        """What is wrong with a suite; empty if it passes."""
        objects = [(changed or {}).get(unit, self._object(unit)) for unit in suite.sources]
        linked = subprocess.run(self._linking(*objects, self._object("unity")), capture_output=True)
        if linked.returncode:
            return f"does not link: {linked.stderr.decode(errors='replace')[-500:]}"
        try:
            # Limit processor time, since a busy machine makes any suite slow.
            limited = ["prlimit", f"--cpu={math.ceil(limit_s)}", self._program]
            done = subprocess.run(limited, capture_output=True, timeout=600)
        except subprocess.TimeoutExpired:
            return "hangs"
        # RUN_SUITE always returns 0; Unity's last line says how it went.
        return "" if done.returncode == 0 and done.stdout.rstrip().endswith(b"\nOK") else "fails"

    def _linked(self, main: Path, units: list[Path]) -> list[Path]:
        """The units that a suite needs, as reported by the linker."""
        archive = self.folder / "all.a"
        if not archive.exists():
            self._run(["ar", "rcs", archive, *map(self._object, units)])
        said = self._run(self._linking(self._object(main), self._object("unity"), archive, "-Wl,-t,-t"))
        members = {line.rpartition(")")[2] for line in said.splitlines() if line.startswith("(")}
        return [unit for unit in units if self._object(unit).name in members]

    def _linking(self, *parts: Path | str) -> list:
        """The command that links these into the suite's program."""
        return [COMPILER, *FLAGS, *parts, "-o", self._program]

    def _compile(self, unit: Path) -> frozenset[Path]:
        """Compile a unit; return the files that it depends on, itself included."""
        target = self._object(unit)
        self._run([COMPILER, *FLAGS, *self.includes, "-MMD", "-c", self.folder / unit, "-o", target])
        words = re.sub(r"\\\n", " ", target.with_suffix(".d").read_text()).split(": ", 1)[1].split()
        return frozenset(
            Path(word).resolve().relative_to(self.folder)
            for word in words
            if Path(word).resolve().is_relative_to(self.folder)
        )

    def _compiles(self, unit: Path, target: Path) -> bool:
        command = [COMPILER, *FLAGS, *self.includes, "-c", self.folder / unit, "-o", target]
        return subprocess.run(command, capture_output=True).returncode == 0

    def _object(self, unit: Path | str) -> Path:
        return self.folder / "objects" / (str(unit).replace("/", "_").removesuffix(".cpp") + ".o")

    @staticmethod
    def _run(command: list) -> str:
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr)
        return done.stdout


def _unity() -> Path:
    """Folder of Unity's sources, which PlatformIO has installed for the native suites."""
    found = sorted(PROJECT.glob(".pio/libdeps/*/Unity/src/unity.c"))
    if not found:
        raise RuntimeError("Unity is not installed: run `.venv/bin/pio test -e native` once")
    return found[0].parent
