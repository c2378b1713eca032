# SPDX-License-Identifier: GPL-3.0-or-later
"""Compile the C parts beside their packages: `python -m virtual_robot.build`.

`uno` needs libsimavr (Debian: libsimavr-dev libelf-dev); the others need only a C compiler, so data sets can be
generated where libsimavr is missing. Nothing is rebuilt when the objects are newer than their sources.
"""

import re
import sys
import sysconfig
import tempfile
from dataclasses import dataclass
from pathlib import Path

from cffi import FFI

HERE = Path(__file__).resolve().parent
_COMPILE = ["-O3", "-flto", "-fvisibility=hidden", "-fno-math-errno", "-fno-trapping-math", "-std=gnu11"]
_COMPILE += ["-Wall", "-Wextra", "-Wno-missing-field-initializers"]


@dataclass(frozen=True)
class Part:
    """One C part: its folder, the header that declares its interface, and the libraries it is linked with."""

    name: str
    header: str
    libraries: tuple[str, ...]
    include: tuple[str, ...] = ()

    @property
    def folder(self) -> Path:
        return HERE / self.name / "src"

    @property
    def built(self) -> Path:
        return HERE / self.name / f"_{self.leaf}{sysconfig.get_config_var('EXT_SUFFIX')}"

    @property
    def needs(self) -> str:
        packages = ", libsimavr-dev and libelf-dev" if "simavr" in self.libraries else ""
        return f"setuptools and cffi from PyPI, a C compiler, python3-dev{packages}"

    @property
    def leaf(self) -> str:
        return self.name.rpartition("/")[2]

    @property
    def module(self) -> str:
        return f"virtual_robot.{self.name.replace('/', '.')}._{self.leaf}"

    def sources(self) -> list[Path]:
        return sorted(self.folder.glob("*.c"))

    def is_fresh(self) -> bool:
        inputs = [*self.folder.iterdir(), Path(__file__)]
        return self.built.exists() and self.built.stat().st_mtime > max(p.stat().st_mtime for p in inputs)


PARTS = (
    Part("plant", "plant.h", ("m",)),
    Part("truths/foreign", "foreign.h", ("m",)),
    Part("uno", "uno.h", ("simavr", "elf", "util"), ("/usr/include/simavr",)),
)


def declarations(header: Path) -> str:
    """The header without comments and preprocessor lines, as cffi needs it."""
    text = re.sub(r"//[^\n]*", "", header.read_text(encoding="utf-8"))
    return "\n".join(line for line in text.splitlines() if not line.lstrip().startswith("#"))


def compile_part(part: Part, target: Path) -> None:
    ffi = FFI()
    ffi.cdef(declarations(part.folder / part.header))
    ffi.set_source(
        part.module,
        f'#include "{part.header}"',
        sources=[str(p) for p in part.sources()],
        include_dirs=[str(part.folder), *part.include],
        libraries=list(part.libraries),
        extra_compile_args=_COMPILE,
        extra_link_args=["-flto", "-O3"],
    )
    with tempfile.TemporaryDirectory() as scratch:
        built = Path(ffi.compile(tmpdir=scratch, verbose=False))
        new = target.with_suffix(".new")
        new.write_bytes(built.read_bytes())
        new.replace(target)  # atomic: a running process keeps the object that it has loaded


def main(names: list[str]) -> int | str:
    for part in PARTS:
        if (not names or part.name in names) and not part.is_fresh():
            print(f"compiling virtual_robot/{part.name}", flush=True)
            try:
                compile_part(part, part.built)
            except Exception as error:  # cffi raises several kinds, even a plain Exception without setuptools
                return f"error: {error}\nvirtual_robot/{part.name} did not compile; it needs {part.needs}"
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
