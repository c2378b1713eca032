"""Gaits: the definition of speed, searches for the fastest and the most robust gait, and a library for scenarios.

from bifa.gait import Settings, optimize, simulations
with simulations() as runs:
    optimum = optimize(model, runs, Settings(robust=True, seed=1))

Names are imported on first use, so that the library can be read without the seconds it takes to import the search.
"""

import importlib
from typing import TYPE_CHECKING, Any

_PLACES = {
    "metric": ("Metric",),
    "pool": ("simulations",),
    "prediction": ("predict_speed",),
    "search": ("Optimum", "SearchError", "Settings", "optimize"),
    "space": ("paper_space",),
    "uncertainty": ("UncertaintyError", "spread_of"),
}

__all__ = [name for names in _PLACES.values() for name in names]

if TYPE_CHECKING:
    from bifa.gait.metric import Metric as Metric
    from bifa.gait.pool import simulations as simulations
    from bifa.gait.search import Optimum as Optimum
    from bifa.gait.search import SearchError as SearchError
    from bifa.gait.search import Settings as Settings
    from bifa.gait.search import optimize as optimize
    from bifa.gait.space import paper_space as paper_space
    from bifa.gait.uncertainty import UncertaintyError as UncertaintyError
    from bifa.gait.uncertainty import spread_of as spread_of


def __getattr__(name: str) -> Any:
    for place, names in _PLACES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{place}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
