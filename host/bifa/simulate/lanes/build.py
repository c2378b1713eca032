"""Compiles the kernel into the user's cache whenever its sources have changed. Takes a few seconds."""

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from bifa.files import written
from bifa.simulate import entries, generated

FLAGS = (
    "-O2", "-std=gnu11", "-fPIC", "-shared", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=fast", "-w",
)  # fmt: skip
SINGLE = "-DSINGLE"
HERE = Path(__file__).parent
_OWN = ("translate.py", "program.py", "vectors.h", "tables.h", "drive.c")


@dataclass(frozen=True)
class Target:
    """A kind of processor: number of lanes, compiler flags, and CPU features that it needs."""

    lanes: int
    flags: tuple[str, ...]
    needs: tuple[str, ...]


TARGETS = (
    Target(8, ("-mavx512f", "-mavx512dq", "-mavx512vl", "-mavx2", "-mfma"), ("avx512f", "avx512dq", "avx512vl")),
    Target(4, ("-mavx2", "-mfma"), ("avx2", "fma")),
    Target(2, (), ()),
)


class NoKernelError(Exception):
    """The kernel cannot be compiled or loaded here; the text says why."""


@cache
def target() -> Target:
    """The widest target that this processor supports."""
    from llvmlite import binding

    has = binding.get_host_cpu_features()
    return next(one for one in TARGETS if all(has.get(feature) for feature in one.needs))


def one_lane() -> Target:
    """A target with one lane, for this processor."""
    return Target(1, target().flags if target().lanes > 2 else (), ())


def single_precision() -> Target:
    """The widest target in single precision, with twice the lanes. Without AVX it would be slower than double."""
    double = target()
    return Target(2 * double.lanes, (*double.flags, SINGLE), double.needs) if double.needs else double


def compiler() -> list[str]:
    """Command of the C compiler: CC, which may have arguments, else cc, gcc or clang. Raises NoKernelError if there is
    none."""
    for command in (os.environ.get("CC", "").split(), ["cc"], ["gcc"], ["clang"]):
        if command and (found := shutil.which(command[0])):
            return [found, *command[1:]]
    raise NoKernelError("no C compiler (Debian: gcc)")


def library(chosen: Target) -> Path:
    """Path of the compiled kernel, compiled now if missing. Raises NoKernelError if that fails."""
    texts = [(HERE / name).read_text("utf-8") for name in _OWN]
    name = f"bifa_lanes_{generated.digest(*entries.sources(), *texts, *FLAGS, *chosen.flags)}_{chosen.lanes}.so"

    def make(aside: Path) -> None:
        compiler()
        what = f"{chosen.lanes}-lane{' single-precision' if SINGLE in chosen.flags else ''} simulator"
        print(f"Compiling the {what} (first run only)...", file=sys.stderr, flush=True)
        compile_to(aside, chosen)

    return generated.cached(name, make)


def compile_to(path: Path, chosen: Target) -> None:
    """Compile a kernel to `path`. Raises NoKernelError if that fails."""
    from bifa.simulate.lanes import program

    command = [*compiler(), *FLAGS, *chosen.flags, f"-DLANES={chosen.lanes}"]
    with written(path) as built, tempfile.TemporaryDirectory(dir=path.parent) as scratch:
        source = Path(scratch) / "lanes.c"
        source.write_text(program.source(), "utf-8")
        try:
            subprocess.run([*command, str(source), "-o", str(built), "-lm"], check=True, capture_output=True, text=True)
        except (OSError, subprocess.CalledProcessError) as e:
            told = (getattr(e, "stderr", None) or str(e)).strip().splitlines()
            raise NoKernelError(f"{command[0]} failed: {told[0] if told else e}") from e
