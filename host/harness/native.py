"""Compile the Uno's own code (lib/) for this computer, so that tests can run it millions of times."""

import hashlib
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path

import cffi

ROOT = Path(__file__).parents[2]
BUILD = ROOT / "build/native"


def compiled(name: str, command: Sequence[str], sources: Sequence[Path], included: Sequence[Path] = ()) -> Path:
    """Compile the sources with the headers of lib/; cached by the contents of all of them. Return the path.

    Raises RuntimeError with the compiler's messages.
    """
    headers = sorted((ROOT / "lib").glob("*/*.h"))
    contents = [repr([*command]).encode(), *(path.read_bytes() for path in [*sources, *included, *headers])]
    digest = hashlib.sha256(b"".join(contents)).hexdigest()[:16]
    target = BUILD / f"{name}-{digest}"
    if not target.exists():
        BUILD.mkdir(parents=True, exist_ok=True)
        partial = target.with_suffix(f".{os.getpid()}.tmp")
        includes = [f"-I{folder}" for folder in sorted((ROOT / "lib").iterdir())]
        done = subprocess.run([*command, *includes, *sources, "-o", partial], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr)
        partial.replace(target)
    return target


def load(harness: Path, declarations: str, parts: tuple[str, ...] = ("*/*.cpp",)) -> tuple[cffi.FFI, object]:
    """Load the harness (a C++ file with C functions), linked with parts of lib/, as a cffi library."""
    sources = [harness, *sorted(path for part in parts for path in (ROOT / "lib").glob(part))]
    ffi = cffi.FFI()
    ffi.cdef(declarations)
    command = ("g++", "-std=gnu++11", "-O2", "-Wall", "-Wextra", "-shared", "-fPIC")
    return ffi, ffi.dlopen(str(compiled(harness.stem, command, sources)))
