"""Gaits: what counts as speed, the search for the fastest and for the most robust, a library for scenarios.

from bifa.gait import Settings, optimize, simulations
with simulations() as runs:
    optimum = optimize(model, runs, Settings(robust=True, seed=1))

Names are loaded when they are used: the library of gaits is read without the seconds that the search takes to import.
"""

import importlib
from typing import TYPE_CHECKING, Any

_PLACES = {
    "Metric": "metric",
    "Knowledge": "uncertainty",
    "Optimum": "search",
    "Passage": "metric",
    "Prediction": "prediction",
    "SearchError": "search",
    "SearchSpace": "space",
    "Settings": "search",
    "SpaceError": "space",
    "UncertaintyError": "uncertainty",
    "optimize": "search",
    "measured_speed": "measured",
    "paper_space": "space",
    "predict_speed": "prediction",
    "simulations": "pool",
    "spread_of": "uncertainty",
}

__all__ = list(_PLACES)

if TYPE_CHECKING:
    from bifa.gait.metric import Metric as Metric
    from bifa.gait.metric import Passage as Passage
    from bifa.gait.pool import simulations as simulations
    from bifa.gait.search import Optimum as Optimum
    from bifa.gait.search import SearchError as SearchError
    from bifa.gait.search import Settings as Settings
    from bifa.gait.search import optimize as optimize
    from bifa.gait.space import SearchSpace as SearchSpace
    from bifa.gait.space import SpaceError as SpaceError
    from bifa.gait.space import paper_space as paper_space
    from bifa.gait.uncertainty import UncertaintyError as UncertaintyError
    from bifa.gait.uncertainty import spread_of as spread_of


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_PLACES[name]}"), name)
