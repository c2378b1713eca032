"""Reductions over lanes (`bifa.simulate.lanes`). With a single lane, each returns its argument."""

from __future__ import annotations

from bifa.simulate.compiled import merged


@merged
def worst(run, value):
    """The greatest value among the lanes that share their steps."""
    return value


@merged
def least(run, value):
    """The smallest value among the lanes that share their steps."""
    return value


@merged
def anyone(run, condition):
    """Whether the condition holds in any of the lanes that share their steps."""
    return condition


@merged
def anywhere(condition):
    """Whether the condition holds in any lane, whether or not lanes share their steps."""
    return condition
