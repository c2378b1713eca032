"""Generated Python source, kept in the user's cache under a name that contains the hash of its text.

numba caches compiled code by file, but does not notice a change in a function of another file that is called from
there. Everything with an on-disk cache is therefore in files whose names change with any of their sources.
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

from bifa.errors import BifaError
from bifa.files import write_text

_KEEP_S = 30 * 86400.0


def digest(*texts: str) -> str:
    """Short hash of the texts and the versions of numba and Python."""
    whole = "\0".join((numba.__version__, sys.version, *texts))
    return hashlib.sha256(whole.encode()).hexdigest()[:16]


def folder() -> Path:
    """Folder of generated code: BIFA_CACHE_DIR, else in the user's cache, else a private temporary folder."""
    with contextlib.suppress(OSError, RuntimeError):  # RuntimeError: no home directory
        users = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        chosen = Path(os.environ.get("BIFA_CACHE_DIR") or Path(users) / "bifa")
        chosen.mkdir(parents=True, exist_ok=True)
        if os.access(chosen, os.W_OK):
            return chosen
    try:
        return temporary_folder()
    except OSError as error:
        raise BifaError("no writable folder for compiled code: set BIFA_CACHE_DIR to one") from error


@functools.cache
def temporary_folder() -> Path:
    """A folder shared by the user's processes if only this user can write to it, since its code is executed; otherwise
    one for this process alone."""
    candidate = Path(tempfile.gettempdir()) / f"bifa-{os.getuid() if hasattr(os, 'getuid') else 0}"
    with contextlib.suppress(OSError):
        candidate.mkdir(mode=0o700, exist_ok=True)
        if _is_ours_alone(candidate):
            return candidate
    return Path(tempfile.mkdtemp(prefix="bifa-"))


def _is_ours_alone(there: Path) -> bool:
    if not hasattr(os, "getuid"):
        return there.is_dir()  # on Windows, the temporary folder belongs to the user
    found = there.lstat()  # not stat: a symbolic link could be redirected later
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


def load(stem: str, source: str) -> ModuleType:
    """Import `source` as a module, writing its file first if it does not exist. `stem` and a hash form its name."""
    name = f"bifa_{stem}_{digest(source)}"
    if name in sys.modules:
        return sys.modules[name]
    path = folder() / f"{name}.py"
    for compiled in path.parent.glob(f"__pycache__/{name}.*.nb[ci]"):
        with contextlib.suppress(OSError):
            if not compiled.stat().st_size:  # after a power cut; numba would fail
                compiled.unlink()
    if not path.exists():
        write_text(path, source)
        forget_old(path.parent)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is not a Python module")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def forget_old(cache: Path) -> None:
    """Remove generated files that have not been read for a month."""
    limit = time.time() - _KEEP_S
    for old in (*cache.glob("bifa_*.py"), *cache.glob("bifa_*.so"), *cache.glob("__pycache__/bifa_*")):
        with contextlib.suppress(OSError):
            if old.stat().st_atime < limit:
                old.unlink()
