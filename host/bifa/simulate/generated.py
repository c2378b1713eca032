"""Python source that is written by the program, kept in the user's cache under a name that is a hash of its text.

numba caches compiled code by file, but does not notice when a function in another file, called from there, has
changed. So everything with an on-disk cache lives in files whose very name changes with any of its sources.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.util
import os
import stat
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
    """Where generated code lives: BIFA_CACHE_DIR, else the user's cache, else a temporary one, the user's alone."""
    named = os.environ.get("BIFA_CACHE_DIR")
    chosen = Path(named) if named is not None else _users_cache() / "bifa"
    with contextlib.suppress(OSError):
        chosen.mkdir(parents=True, exist_ok=True)
        if os.access(chosen, os.W_OK):
            return chosen
    try:
        return temporary_folder()
    except OSError as error:
        raise OSError("no folder can be written for compiled code; set BIFA_CACHE_DIR") from error


def _users_cache() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


@functools.cache
def temporary_folder() -> Path:
    """One for every process if only this user can write there, since its code is executed; else this process's own."""
    candidate = Path(tempfile.gettempdir()) / f"bifa-{os.getuid() if hasattr(os, 'getuid') else 0}"
    with contextlib.suppress(OSError):
        candidate.mkdir(mode=0o700, exist_ok=True)
        if _is_ours_alone(candidate):
            return candidate
    return Path(tempfile.mkdtemp(prefix="bifa-"))


def _is_ours_alone(there: Path) -> bool:
    if not hasattr(os, "getuid"):
        return there.is_dir()  # Windows' temporary folder is the user's own
    found = there.lstat()  # a link may be led elsewhere later
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


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
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is no module")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
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
