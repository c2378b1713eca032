"""Compiles the Uno's own code (lib/) for this computer, so that proofs run millions of times."""

import hashlib
import subprocess
from pathlib import Path

import cffi

ROOT = Path(__file__).parents[2]
BUILD = ROOT / "build/native"


def load(harness: Path, declarations: str, parts: tuple[str, ...] = ("*/*.cpp",)) -> tuple[cffi.FFI, object]:
    """The harness (a C++ file with C functions) linked with parts of lib/, as a cffi library."""
    sources = [harness, *sorted(path for part in parts for path in (ROOT / "lib").glob(part))]
    headers = sorted((ROOT / "lib").glob("*/*.h"))
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in [*sources, *headers])).hexdigest()[:16]
    library = BUILD / f"{harness.stem}-{digest}.so"
    if not library.exists():
        BUILD.mkdir(parents=True, exist_ok=True)
        partial = library.with_suffix(f".{id(library)}.tmp")
        includes = [f"-I{folder}" for folder in sorted((ROOT / "lib").iterdir())]
        subprocess.run(
            ["g++", "-std=gnu++11", "-O2", "-Wall", "-Wextra", "-shared", "-fPIC", *includes, *sources, "-o", partial],
            check=True,
        )
        partial.replace(library)
    ffi = cffi.FFI()
    ffi.cdef(declarations)
    return ffi, ffi.dlopen(str(library))
