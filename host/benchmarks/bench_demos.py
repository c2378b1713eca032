"""The demo with ten seeds: see `benchmarks.demos`. Takes half an hour or more; an interrupted run resumes."""

from benchmarks import demos


def run() -> dict[str, float]:
    """Print the table; return the figures flat."""
    return demos.run(range(demos.FIRST_SEED, demos.FIRST_SEED + demos.SEEDS), demos.OUT, demos.JOBS)
