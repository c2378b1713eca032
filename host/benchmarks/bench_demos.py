"""The demo with ten seeds: see `benchmarks.demos`. Half an hour and more; an interrupted run goes on."""

from __future__ import annotations

from benchmarks import demos


def run() -> dict[str, float]:
    """Print the table; returns the figures flat."""
    return demos.run(range(demos.FIRST_SEED, demos.FIRST_SEED + demos.SEEDS), demos.OUT, demos.JOBS)
