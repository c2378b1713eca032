"""Systems with a known structural error, and methods that people use to find it: `make bench ARGS="--only systems"`."""
