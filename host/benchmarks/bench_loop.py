"""The whole loop on every effect of the library: see `benchmarks.loop`. Two hours and more; resumes."""

from __future__ import annotations

from benchmarks import loop


def run() -> dict[str, float]:
    """Print the table; returns the figures flat."""
    return loop.run(loop.LIBRARY, range(loop.FIRST_SEED, loop.FIRST_SEED + loop.SEEDS), loop.OUT)
