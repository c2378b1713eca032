"""Python source that is written by the program, kept in the user's cache under a name that is a hash of its text.

numba caches compiled code by file, but does not notice when a function in another file, called from there, has
changed. So everything with an on-disk cache lives in files whose very name changes with any of its sources.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import os
import sys
import tempfile
import time
from pathlib import Path
from types import ModuleType

import numba

_KEEP_S = 30 * 86400.0


def digest(*texts: str) -> str:
    """Short hash of texts and of the compiler's version."""
    whole = "\0".join((numba.__version__, sys.version, *texts))
    return hashlib.sha256(whole.encode()).hexdigest()[:16]


def folder() -> Path:
    """Where generated code lives: BIFA_CACHE_DIR, else the user's cache, else a temporary folder."""
    chosen = os.environ.get("BIFA_CACHE_DIR")
    if chosen is None:
        chosen = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "bifa"
    for candidate in (
        Path(chosen),
        Path(tempfile.gettempdir()) / f"bifa-{os.getuid() if hasattr(os, 'getuid') else 0}",
    ):
        with contextlib.suppress(OSError):
            candidate.mkdir(parents=True, exist_ok=True)
            if os.access(candidate, os.W_OK):
                return candidate
    raise OSError("no folder can be written for compiled code; set BIFA_CACHE_DIR")


def load(stem: str, source: str) -> ModuleType:
    """Import `source` from its file, written first if it is new. The name tells the hash apart."""
    name = f"bifa_{stem}_{digest(source)}"
    if name in sys.modules:
        return sys.modules[name]
    path = folder() / f"{name}.py"
    if not path.exists():
        _write(path, source)
        forget_old(path.parent)
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def _write(path: Path, source: str) -> None:
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(source)
    os.replace(temporary, path)


def forget_old(cache: Path) -> None:
    """Remove what has not been read for a month."""
    limit = time.time() - _KEEP_S
    for old in (*cache.glob("bifa_*.py"), *cache.glob("bifa_*.so"), *cache.glob("__pycache__/bifa_*")):
        with contextlib.suppress(OSError):
            if old.stat().st_atime < limit:
                old.unlink()
