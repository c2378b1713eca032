"""Predictions for the gait on the page's sliders: the model's own speed at once, then the interval."""

import os
import sys
import threading
from functools import cached_property, lru_cache
from typing import Any

from bifa.errors import BifaError
from bifa.gait.prediction import Predictor
from bifa.gait.uncertainty import spread_of
from bifa.robot import Model
from bifa.robot.gait import Gait
from bifa.simulate import speed

_DRAWS = 128  # half a second of one core
_CACHE_SIZE = 32


def lower_priority() -> None:
    """Lower this thread's priority below all others'; only Linux can do so for a single thread."""
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 10)


class GaitPrediction:
    """Predictions of one model, to be made in a separate thread so as not to hold up the others."""

    def __init__(self, model: Model):
        self._model = model
        self.in_full = lru_cache(_CACHE_SIZE)(self._in_full)

    def at_once(self, gait: Gait) -> dict[str, Any]:
        """Return the model's own prediction: speed and slip, or an error."""
        try:
            progress = speed(self._model, gait)
        except BifaError as error:
            return {"error": str(error)}
        slip_mm = round(1e3 * float(progress.slip_m[-1]), 2)
        return {"speed_mm_s": round(float(progress.speed_mm_s), 2), "slip_mm": slip_mm}

    def _in_full(self, gait: Gait) -> dict[str, Any]:
        """Return the same, and in words the prediction that accounts for all that is known of the robot."""
        found = self.at_once(gait)
        return found if "error" in found else found | {"predicted": self.predictor.of(gait, workers=1).text}

    @cached_property
    def predictor(self) -> Predictor:
        """The predictor, with its robots drawn."""
        return Predictor(self._model, spread_of(self._model), draws=_DRAWS)
