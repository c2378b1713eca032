"""Benchmarks: one file `bench_<topic>.py` per topic, with `run() -> dict[str, float]`."""
