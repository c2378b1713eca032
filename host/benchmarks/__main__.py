"""`make bench`: run the benchmarks, print their figures, and merge them into bench.json at the project's root."""

import argparse
import importlib
import json
import os
import pkgutil
import sys
import time
import traceback
from pathlib import Path

import benchmarks

BENCH_JSON = Path(__file__).resolve().parents[2] / "bench.json"
PREFIX = "bench_"


def main() -> int:
    """Run each `bench_<topic>.run()`; a failing one is reported and the others still run."""
    modules = [module.name for module in pkgutil.iter_modules(benchmarks.__path__)]
    topics = [name.removeprefix(PREFIX) for name in modules if name.startswith(PREFIX)]
    parser = argparse.ArgumentParser(prog="make bench", description="Print every figure the project claims.")
    parser.add_argument("--only", metavar="TOPIC", choices=topics, help=f"run one: {', '.join(topics)}")
    only = parser.parse_args().only
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # as on a machine where bifa has run before, with bytecode cached

    failed = []
    for topic in [only] if only else topics:
        print(f"\n== {topic} ==", flush=True)
        start = time.perf_counter()
        try:
            figures = importlib.import_module(f"benchmarks.{PREFIX}{topic}").run()
        except Exception:
            traceback.print_exc()
            failed.append(topic)
            continue
        merge(figures, BENCH_JSON)
        print(f"({time.perf_counter() - start:.0f} s)")
    print(f"\nfigures: {BENCH_JSON}")
    if failed:
        print(f"failed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


def merge(figures: dict[str, float], path: Path) -> None:
    """Write `figures` (flat, name -> number) into the JSON file at `path`, keeping the figures of other benchmarks."""
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    unfinished = path.with_suffix(".json.unfinished")
    unfinished.write_text(json.dumps(dict(sorted((known | figures).items())), indent=2) + "\n")
    unfinished.replace(path)


if __name__ == "__main__":
    sys.exit(main())
