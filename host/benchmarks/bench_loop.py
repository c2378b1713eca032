"""The whole loop on every effect of the library: see `benchmarks.loop`. Takes two hours or more; can be resumed."""

from benchmarks import loop


def run() -> dict[str, float]:
    """Print the table; return the figures flat."""
    return loop.run(loop.LIBRARY, range(loop.FIRST_SEED, loop.FIRST_SEED + loop.SEEDS), loop.OUT)
