"""What people use, one way a file, each with `solve(problem) -> RivalAnswer`."""
