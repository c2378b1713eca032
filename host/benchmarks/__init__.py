"""Benchmarks: one topic a file `bench_<topic>.py`, offering `run() -> dict[str, float]`."""
