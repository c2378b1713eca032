"""Gaits: what counts as speed, the search for the fastest and for the most robust, a library for scenarios.

from bifa.gait import Settings, optimize, simulations
with simulations() as runs:
    optimum = optimize(model, runs, Settings(robust=True, seed=1))

Names are loaded when they are used: the library of gaits is read without the seconds that the search takes to import.
"""

import importlib
from typing import TYPE_CHECKING, Any

_PLACES = {
    "metric": ("Metric", "Passage"),
    "pool": ("simulations",),
    "prediction": ("Prediction", "predict_speed"),
    "search": ("Optimum", "SearchError", "Settings", "optimize"),
    "settling": ("measured_speed",),
    "space": ("SearchSpace", "SpaceError", "paper_space"),
    "uncertainty": ("Knowledge", "UncertaintyError", "spread_of"),
}

__all__ = [name for names in _PLACES.values() for name in names]

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
    for place, names in _PLACES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{place}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
