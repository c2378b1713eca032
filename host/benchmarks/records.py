"""Results of a long trial, one line of JSON per set, gzipped if the name ends in .gz, to resume it elsewhere."""

import gzip
import json
from collections.abc import Iterable
from operator import itemgetter
from pathlib import Path
from typing import Any


def read(path: Path | None, *names: str) -> dict[Any, dict]:
    """Records keyed by their values of `names`, a tuple if there are several; empty if there is no file."""
    if path is None or not path.exists():
        return {}
    with _opened(path, path, "rt") as lines:
        return {itemgetter(*names)(record): record for record in map(json.loads, lines)}


def write(path: Path, records: Iterable[dict]) -> None:
    """Write the records, replacing the file atomically."""
    new = path.with_suffix(".new")
    with _opened(new, path, "wt") as lines:
        lines.writelines(f"{json.dumps(rounded(record))}\n" for record in records)
    new.replace(path)


def _opened(path: Path, named: Path, how: str) -> Any:
    opened = gzip.open if named.suffix == ".gz" else open
    return opened(path, how, encoding="utf-8")


def rounded(value: Any) -> Any:
    """`value` with every float rounded to six significant digits."""
    if isinstance(value, dict):
        return {k: rounded(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(v) for v in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value
