"""Walk gaits on a rig and compare what was measured with what the model predicts."""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bifa.campaign.stages import OnProgress
from bifa.data import Dataset, DatasetWriter, Trial
from bifa.gait.measured import MeasuredSpeed, measured_speed
from bifa.gait.prediction import Prediction, predict_speed
from bifa.gait.settling import LEAST, MOST_CYCLES, Walking
from bifa.gait.uncertainty import spread_of
from bifa.link import Uno
from bifa.measure.experiments import record_columns
from bifa.measure.plan import PlannedTrial
from bifa.problem.switches import seconds_per_uno_s, valves_of
from bifa.rig import Rig
from bifa.robot import Model
from bifa.robot.gait import Gait
from bifa.simulate import of_gait, walk


def measure_walks(
    rig: Rig,
    folder: Path,
    gaits: Mapping[str, Gait],
    cycles: int | Mapping[str, int],
    repeats: int = 1,
    on_progress: OnProgress = lambda what, share: None,
) -> Dataset:
    """Walk every gait `repeats` times on the rig for as many `cycles`, or for its own, into the data set `folder` of
    trials named after the gaits; walks that an interrupted run has left there are not walked again.

    On a rig that needs nobody a walk that has not settled is walked again for twice as long, up to `MOST_CYCLES`.
    """
    record = getattr(rig, "recorder", None) or _settled
    each = cycles if isinstance(cycles, Mapping) else dict.fromkeys(gaits, cycles)
    total = len(gaits) * repeats
    with Uno(rig.transport, rig.clock, rig.next_session_seed()) as uno:
        hello = uno.connect()
        uno.clear()
        writer = DatasetWriter(folder, "walks", {}, {"firmware": hello.firmware}, resume=True)
        for number, (name, repeat) in enumerate(itertools.product(gaits, range(1, repeats + 1)), start=1):
            planned = PlannedTrial("locomotion", gait=gaits[name], cycles=each[name], repeat=repeat)
            if writer.has(planned.as_trial()):
                continue

            def show(share: float, name: str = name) -> None:
                on_progress(name, share)

            trial = record(rig, uno, planned, show, number=number, total=total, writer=writer)
            writer.add(replace(trial, file=f"{name}_{repeat}.csv", session_order=number))
    return writer.finish()


def _walk(rig: Rig, uno: Uno, planned: PlannedTrial, on_progress: Callable[[float], None], **_: Any) -> Trial:
    """The `Recorder` of walks on a rig that needs nobody."""
    columns, extra = record_columns(rig, uno, planned, on_progress)
    return planned.as_trial(columns, extra=extra)


def _settled(rig: Rig, uno: Uno, planned: PlannedTrial, on_progress: Callable[[float], None], **_: Any) -> Trial:
    """The same until the walk has settled, or has had time enough for that."""
    while True:
        trial = _walk(rig, uno, planned, on_progress)
        short = planned.cycles < LEAST
        if short or planned.cycles >= MOST_CYCLES or speed_of(trial).walking is not Walking.UNSETTLED:
            return trial
        planned = replace(planned, cycles=min(2 * planned.cycles, MOST_CYCLES))


def planned_cycles(model: Model, gait: Gait, least: int) -> int:
    """For how many cycles to walk: near the edge a robot may stand nearly still for several before it walks, so that
    the first ones tell nothing; the model foretells how many."""
    return int(np.clip(predict_speed(model, spread_of(model), gait).cycles, least, MOST_CYCLES))


def speed_of(trial: Trial) -> MeasuredSpeed:
    """What was measured in one walk."""
    return measured_speed(trial.time_s, trial.columns["displacement_head_mm"], trial.walked["period_s"])


def foretold(model: Model, trial: Trial, naive: bool = False) -> Prediction:
    """What the model says of the walk in `trial`, of which only the clock's rate is used; naive: by its covariance
    alone."""
    known = spread_of(model)
    rate = seconds_per_uno_s(trial)
    return predict_speed(model, known.naive if naive else known, Gait(**trial.walked), clock_rate=rate)


def speeds(dataset: Dataset) -> dict[str, list[MeasuredSpeed]]:
    """The measured speeds of each gait's repeats, by the name that `measure_walks` gave."""
    measured: dict[str, list[MeasuredSpeed]] = {}
    for trial in dataset.trials:
        measured.setdefault(trial.file.rsplit("_", 1)[0], []).append(speed_of(trial))
    return measured


def predict(model: Model, trial: Trial) -> dict[str, Any]:
    """The model's own record of the walk that `trial` holds, on the trial's clock: the same columns."""
    gait = Gait(**trial.walked)
    commands = valves_of(of_gait(gait, trial.time_s[-1] + gait.period_s), trial)
    columns = walk(model, commands=commands, time_s=trial.time_s * seconds_per_uno_s(trial)).columns
    return dict(columns) | {"time_s": trial.time_s}


def predicted_speed(model: Model, trial: Trial) -> float:
    """The settled speed that the model gives to the walk in `trial`, judged as the measured one is; mm/s."""
    columns = predict(model, trial)
    return measured_speed(columns["time_s"], columns["displacement_head_mm"], trial.walked["period_s"], 0.0).mean_mm_s
