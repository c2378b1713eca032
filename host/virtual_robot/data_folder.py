# SPDX-License-Identifier: GPL-3.0-or-later
"""Write a data set in the contract's format, complete or not at all, with as many digits as the instruments give."""

import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from virtual_robot.errors import VirtualRobotError

_LARGEST = 10.0  # times the modest size: beyond it some robots cannot be simulated


def check_numbers(seed: int, size: float | None = None) -> None:
    """Raise VirtualRobotError if the seed, or the factor of an effect's modest size, is out of range."""
    if seed < 0:
        raise VirtualRobotError(f"seed = {seed} must not be negative")
    if size is not None and not 0.0 < size <= _LARGEST:
        raise VirtualRobotError(f"size = {size:g} must be above 0 and at most {_LARGEST:g} times the modest size")


def check_new(out: Path) -> None:
    """Raise VirtualRobotError if the data set `out` exists."""
    if out.exists():
        raise VirtualRobotError(f"{out} exists already; data sets are never overwritten")


def seal_of(out: Path, asked: Path | None) -> Path:
    """The file for the truth of the data set `out`: `asked`, or OUT.sealed.toml beside it. Raises VirtualRobotError if
    either exists, or the file cannot be written."""
    check_new(out)
    seal = asked or out.with_name(out.name + ".sealed.toml")
    if seal.exists():
        raise VirtualRobotError(f"{seal} exists already, the truth of another data set; move it away first")
    if asked and not seal.parent.is_dir():
        raise VirtualRobotError(f"the folder {seal.parent} does not exist; create it first")
    return seal


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """A scratch folder beside `out`, renamed to `out` once the block has succeeded and removed if it raises."""
    out.parent.mkdir(parents=True, exist_ok=True)
    scratch = Path(tempfile.mkdtemp(dir=out.parent, prefix=f".{out.name}-"))
    try:
        yield scratch
        scratch.chmod(0o755)
        scratch.rename(out)
    except BaseException:
        shutil.rmtree(scratch, ignore_errors=True)
        raise


def write_head(folder: Path, name: str, known: Mapping[str, float], entries: Iterable[Mapping[str, Any]]) -> None:
    head = {"format": 1, "name": name, "known": dict(known), "trial": list(entries)}
    (folder / "dataset.toml").write_text(tomli_w.dumps(head))


def write_csv(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Write one header line, then the rows."""
    digits = [0 if name.startswith("command") else 3 if name == "force_N" else 4 for name in columns]
    line = ",".join(f"%.{n}f" for n in digits) + "\n"
    rows = np.column_stack(list(columns.values()))
    text = (line * len(rows)) % tuple(rows.ravel())
    path.write_text(",".join(columns) + "\n" + text, encoding="utf-8")
