"""Optimisers from established libraries behind one call: maximise a batched objective over the unit cube."""

from .bayesian import bayesian_optimization
from .cma_es import cma_es
from .common import Evaluated
from .evolution import differential_evolution

METHODS = {"cma": cma_es, "de": differential_evolution, "bo": bayesian_optimization}

__all__ = ["METHODS", "Evaluated"]
