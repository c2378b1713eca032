"""What a long trial found, a line of JSON a robot, so that it goes on from there on another machine."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Iterable
from pathlib import Path
from typing import Any


def read(path: Path, place: Callable[[dict], Hashable]) -> dict[Any, dict]:
    """Records by their `place` in the trial; none where there is no file."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {place(record): record for record in map(json.loads, lines)}


def write(path: Path, records: Iterable[dict]) -> None:
    """The file is the old one or the new one."""
    new = path.with_suffix(".new")
    new.write_text("".join(f"{json.dumps(rounded(record))}\n" for record in records), encoding="utf-8")
    new.replace(path)


def rounded(value: Any) -> Any:
    """The same with six digits of every number that is no integer."""
    if isinstance(value, dict):
        return {k: rounded(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(v) for v in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value
