"""Systems with a known structural error, and what people use to find it: `make bench ARGS="--only systems"`."""
