"""Methods that people use, one per file, each with `solve(problem) -> RivalAnswer`."""
