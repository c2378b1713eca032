"""What lanes that march side by side agree on (`bifa.simulate.lanes`). In one lane alone each is the value itself."""

from __future__ import annotations

from bifa.simulate.compiled import merged


@merged
def worst(run, value):
    """The greatest among the lanes that share their steps."""
    return value


@merged
def least(run, value):
    """The smallest among them."""
    return value


@merged
def anyone(run, condition):
    """Whether it holds in one of them."""
    return condition


@merged
def anywhere(condition):
    """Whether it holds in a lane, sharing or not."""
    return condition
