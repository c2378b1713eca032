"""What a blind trial found: enough for its report, and for a trial to go on elsewhere."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from benchmarks import records as lines

_ERRORS = ("held_out", "held_out_conditions")


def read(path: Path) -> dict[tuple[str, int], dict]:
    """Records by kind and seed; none where there is no file."""
    return lines.read(path, place)


def place(record: dict) -> tuple[str, int]:
    return record["kind"], record["seed"]


def write(path: Path, records: Iterable[dict]) -> None:
    """Write what a report needs of `records`; the file is the old one or the new one."""
    lines.write(path, map(brief, records))


def brief(record: dict) -> dict:
    """What a report needs of a record."""
    kept = ("kind", "seed", "truth", "sizes", "values", "base_values", "verdict", "processor_seconds", "baselines")
    kept += tuple(name for name in ("version", "simulations") if name in record)  # of trials since they are counted
    estimated = record["base_parameters"]
    known = {
        name: {"interval_90": estimated[name]["interval_90"]} for name in record["base_values"] if name in estimated
    }
    effects = [{k: e[k] for k in ("name", "interval_90", "confusable_with")} for e in record["effects"]]
    error = {of: {e: record["error"][of][e] for e in _ERRORS} for of in ("before", "after", "noise_floor")}
    rest = {"effects": effects, "base_parameters": known, "error": error}
    return {k: record[k] for k in kept} | rest | {"remainder": {"matters": record["remainder"]["matters"]}}


def write_losses(path: Path, record: dict) -> None:
    """Add what was tried of one data set to what lies beside `path`; records read from a file have none."""
    if "search" not in record:
        return
    known = lines.read(losses_beside(path), place)
    known[place(record)] = {name: record[name] for name in ("kind", "seed", "truth")} | record["search"]
    lines.write(losses_beside(path), known.values())


def losses_beside(path: Path) -> Path:
    """Where what was tried is kept: packed, beside the records of a trial."""
    return path.with_suffix(".losses.jsonl.gz")
