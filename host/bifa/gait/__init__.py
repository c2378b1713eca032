"""Gaits: what counts as speed, the search for the fastest and for the most robust, a library for scenarios.

from bifa.gait import Settings, optimise, simulations
with simulations() as runs:
    optimum = optimise(model, runs, Settings(robust=True, seed=1))
"""

from bifa.gait.metric import Metric, Passage
from bifa.gait.search import Optimum, SearchError, Settings, optimise
from bifa.gait.simulations import simulations
from bifa.gait.space import SearchSpace, SpaceError, paper_space
from bifa.gait.uncertainty import UncertaintyError, spread_of

__all__ = [
    "Metric",
    "Optimum",
    "Passage",
    "SearchError",
    "SearchSpace",
    "Settings",
    "SpaceError",
    "UncertaintyError",
    "optimise",
    "paper_space",
    "simulations",
    "spread_of",
]
