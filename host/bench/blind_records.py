"""What a blind trial found, a line of JSON a data set: enough for its report, and for a trial to go on elsewhere."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

_ERRORS = ("held_out", "held_out_conditions")


def read(path: Path) -> dict[tuple[str, int], dict]:
    """Records by kind and seed; none where there is no file."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {place(record): record for record in map(json.loads, lines)}


def place(record: dict) -> tuple[str, int]:
    return record["kind"], record["seed"]


def write(path: Path, records: Iterable[dict]) -> None:
    """Write what a report needs of `records`; the file is the old one or the new one."""
    new = path.with_suffix(".new")
    new.write_text("".join(f"{json.dumps(brief(record))}\n" for record in records), encoding="utf-8")
    new.replace(path)


def brief(record: dict) -> dict:
    """What a report needs of a record."""
    kept = ("kind", "seed", "truth", "sizes", "values", "base_values", "verdict", "processor_seconds", "baselines")
    estimated = record["base_parameters"]
    known = {
        name: {"interval_90": estimated[name]["interval_90"]} for name in record["base_values"] if name in estimated
    }
    effects = [{k: e[k] for k in ("name", "interval_90", "confusable_with")} for e in record["effects"]]
    error = {of: {e: record["error"][of][e] for e in _ERRORS} for of in ("before", "after", "noise_floor")}
    rest = {"effects": effects, "base_parameters": known, "error": error}
    rest |= {"remainder": {"matters": record["remainder"]["matters"]}}
    return _rounded({k: record[k] for k in kept} | rest)


def _rounded(value):
    """The same with six digits of every number that is no integer."""
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_rounded(v) for v in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value
