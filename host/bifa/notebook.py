"""The interface for notebooks (`import bifa`): load a data set; simulate, diagnose, optimise and connect to a robot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bifa.data import Dataset, Trial, read_dataset
from bifa.errors import BifaError
from bifa.robot import BASELINE, Gait, Model, load_model, nominal, read_gait_file, save_model

if TYPE_CHECKING:  # imported on first use, so that a notebook loads only what it needs
    from bifa.gait import Optimum
    from bifa.link import Uno
    from lacuna import Verdict


def load_dataset(folder: str | Path) -> Dataset:
    """Read the data set in `folder`. Raises DatasetError, with file, line and column."""
    return read_dataset(Path(folder))


class Robot:
    """A robot described by a model: the paper's nominal one, one from a model file, or one completed by a diagnosis."""

    def __init__(self, model: Model | str | Path | None = None):
        self.model = nominal() if model is None else model if isinstance(model, Model) else load_model(Path(model))

    def __repr__(self) -> str:
        effects = "".join(f", {name}" for name in self.model.effects)
        return f"Robot({self.model.name!r}{effects})"

    def simulate(self, gait: Gait | str | Path = BASELINE, cycles: int = 5) -> Trial:
        """Simulate a walk from rest, sampled at 100 Hz; returns it as a trial of a data set."""
        from bifa.simulate import walk

        chosen = _gait(gait)
        walked = walk(self.model, chosen, _at_least_one(cycles))
        columns = {name: np.asarray(column) for name, column in walked.columns.items()}
        return Trial(f"{self.model.name}_simulated.csv", "locomotion", columns, gait=chosen.as_dict())

    def speed_mm_s(self, gait: Gait | str | Path = BASELINE, cycles: int = 10) -> float:
        """Simulate a walk from rest; returns the speed of its last cycle."""
        from bifa.simulate import speed

        return float(speed(self.model, _gait(gait), _at_least_one(cycles), 1e-6).speed_mm_s)

    def diagnose(self, dataset: Dataset, *, seed: int = 0, matters: Mapping[str, float] | None = None) -> Verdict:
        """Diagnose from a data set what this robot's base model lacks; returns a `lacuna.Verdict`. `matters`: the RMS
        error, by column, up to which a prediction is good enough. Takes minutes of processor time for a campaign."""
        import lacuna
        from bifa.identify.doubts import with_doubts
        from bifa.identify.start import prepare
        from bifa.problem.accuracy import accuracies

        system = prepare(dataset, self.model)
        system.accuracies = accuracies([f"{name}={value}" for name, value in (matters or {}).items()])
        found = lacuna.diagnose(system, seed=seed)
        return lacuna.Verdict(system, with_doubts(found.diagnosis, system))

    def completed(self, verdict: Verdict) -> Robot:
        """Return the robot completed by a verdict: with its fitted values, effects and learnt curves."""
        from bifa.identify.completed import completed_model

        return Robot(completed_model(verdict.diagnosis.told))

    def optimize(self, *, robust: bool = True, seed: int = 0, evaluations: int | None = None) -> Optimum:
        """Find the fastest gait on this robot or, if `robust`, on nine in ten robots like it; returns a
        `bifa.gait.Optimum` with its `gait`."""
        from bifa.gait import Settings, optimize, simulations

        settings = Settings(robust=robust, seed=seed, evaluations=evaluations)
        with simulations() as runs:
            return optimize(self.model, runs, settings)

    def save(self, path: str | Path) -> None:
        """Write the model file."""
        save_model(Path(path), self.model)


@contextmanager
def connect(port: str | None = None) -> Iterator[Uno]:
    """Connect to the Uno at `port` (a serial port, `virtual`, or None to find it); yields a `bifa.link.Uno`. The valves
    are off at the end."""
    from bifa.link import Uno
    from bifa.rig import open_rig

    with open_rig(port) as rig, Uno(rig.transport, rig.clock) as uno:
        uno.connect()
        yield uno


def _at_least_one(cycles: int) -> int:
    if cycles < 1:
        raise BifaError(f"a walk needs at least one cycle, not {cycles}")
    return cycles


def _gait(gait: Gait | str | Path) -> Gait:
    return gait if isinstance(gait, Gait) else read_gait_file(Path(gait)).gait
