"""Generated Python source, kept in the user's cache under a name that contains the hash of its text.

numba caches compiled code by file, but does not notice a change in a function of another file that is called from
there. Everything with an on-disk cache is therefore in files whose names change with any of their sources.
"""

import contextlib
import functools
import hashlib
import importlib.util
import os
import stat
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
from numba.core.caching import FunctionCache

from bifa.errors import BifaError
from bifa.files import TargetError, written

_KEEP_S = 30 * 86400.0
_ROOM_BYTES = 8 << 20  # more than numba's compiled code of any generated file


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
        tempfile.TemporaryFile(dir=chosen).close()  # permissions reveal neither a quota nor a server that refuses
        return chosen
    return temporary_folder()


@functools.cache
def temporary_folder() -> Path:
    """A folder shared by the user's processes if only this user can write to it, since its code is executed; otherwise
    one for this process alone. Raises BifaError if there is no folder for temporary files."""
    with contextlib.suppress(OSError):
        candidate = Path(tempfile.gettempdir()) / f"bifa-{os.getuid() if hasattr(os, 'getuid') else 0}"
        candidate.mkdir(mode=0o700, exist_ok=True)
        if _is_ours_alone(candidate):
            return candidate
    try:
        return Path(tempfile.mkdtemp(prefix="bifa-"))
    except OSError as error:
        raise BifaError("no writable folder for compiled code: set BIFA_CACHE_DIR to one") from error


def _is_ours_alone(there: Path) -> bool:
    if not hasattr(os, "getuid"):
        return there.is_dir()  # on Windows, the temporary folder belongs to the user
    found = there.lstat()  # not stat: a symbolic link could be redirected later
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


def cached(name: str, make: Callable[[Path], Any]) -> Path:
    """Path of the generated file `name`. If it does not exist, `make(aside)` writes it, in a temporary folder if the
    user's cache is full. Raises TargetError if both are."""
    try:
        return _made(folder() / name, make)
    except TargetError:
        return _made(temporary_folder() / name, make)


def _made(path: Path, make: Callable[[Path], Any]) -> Path:
    if not path.exists():
        with written(path) as aside:
            aside.write_bytes(bytes(_ROOM_BYTES))
            make(aside)
        forget_old(path.parent)
    return path


def load(stem: str, source: str) -> ModuleType:
    """Import `source` as a module, writing its file first if it does not exist. `stem` and a hash form its name."""
    name = f"bifa_{stem}_{digest(source)}"
    if name in sys.modules:
        return sys.modules[name]
    path = cached(f"{name}.py", lambda aside: aside.write_text(source, encoding="utf-8", newline="\n"))
    for compiled in path.parent.glob(f"__pycache__/{name}.*.nb[ci]"):
        with contextlib.suppress(OSError):
            if not compiled.stat().st_size:  # after a power cut; numba would fail
                compiled.unlink()
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
    for function in vars(module).values():
        if isinstance(getattr(function, "_cache", None), FunctionCache):  # what it cannot keep is compiled each time
            function._cache._guard_against_spurious_io_errors = lambda: contextlib.suppress(OSError)
    return module


def forget_old(cache: Path) -> None:
    """Remove generated files that have not been read for a month."""
    limit = time.time() - _KEEP_S
    for old in (*cache.glob("bifa_*.py"), *cache.glob("bifa_*.so"), *cache.glob("__pycache__/bifa_*")):
        with contextlib.suppress(OSError):
            if old.stat().st_atime < limit:
                old.unlink()
