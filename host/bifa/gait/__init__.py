"""Gaits: what counts as speed, the search for the fastest and for the most robust, a library for scenarios.

from bifa.gait import Settings, optimise, simulations
with simulations() as runs:
    optimum = optimise(model, runs, Settings(robust=True, seed=1))

Names are loaded when they are used: the library of gaits is read without the seconds that the search takes to import.
"""

import importlib

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
    "optimise": "search",
    "measured_speed": "measured",
    "paper_space": "space",
    "predict_speed": "prediction",
    "simulations": "pool",
    "spread_of": "uncertainty",
}

__all__ = list(_PLACES)


def __getattr__(name: str):
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_PLACES[name]}"), name)
