"""Walk gaits on a rig and compare the measurements with the model's predictions."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bifa.campaign.stages import OnProgress
from bifa.data import Dataset, DatasetWriter, Trial
from bifa.gait.prediction import Prediction, predict_speed, settles
from bifa.gait.settling import MAX_CYCLES, MIN_CYCLES, MeasuredSpeed, Walking, complete_cycles, measured_speed
from bifa.gait.uncertainty import spread_of
from bifa.link import Uno
from bifa.measure.experiments import Progress
from bifa.measure.plan import Turn, walks
from bifa.measure.session import Recorder, run_session, unattended
from bifa.problem.switches import seconds_per_uno_s, valves_of, walk_timeline
from bifa.rig import Rig
from bifa.robot import Model
from bifa.robot.gait import Gait, GaitFile
from bifa.simulate import walk


def measure_walks(
    rig: Rig,
    folder: Path,
    gaits: Mapping[str, Gait],
    cycles: int | Mapping[str, int],
    repeats: int = 1,
    on_progress: OnProgress = lambda what, share: None,
    record: Recorder | None = None,
) -> Dataset:
    """Walk every gait `repeats` times on the rig, for `cycles` cycles (one number, or one for each gait), into the data
    set `folder`, whose files are named after the gaits. Walks left there by an interrupted run are not repeated.

    record: None on an unattended rig; a walk that has not settled is then repeated for twice as long, up to
    `MAX_CYCLES`.
    """
    each = cycles if isinstance(cycles, Mapping) else dict.fromkeys(gaits, cycles)
    trials = [
        walk for name, gait in gaits.items() for walk in walks(GaitFile(gait), repeats, cycles=each[name], name=name)
    ]
    return run_session(
        rig,
        folder,
        trials,
        name="walks",
        known={},
        provenance={},
        record=record or _until_settled,
        on_event=lambda event: on_progress(event.planned.name, event.share),
    )


def _until_settled(rig: Rig, uno: Uno, turn: Turn, on_progress: Progress, writer: DatasetWriter) -> Trial:
    """`Recorder` of an unattended rig: repeat the walk for longer until it has settled or lasts `MAX_CYCLES`."""
    while True:
        trial, cycles = unattended(rig, uno, turn, on_progress, writer), turn.planned.cycles
        if not MIN_CYCLES <= cycles < MAX_CYCLES or speed_of(trial).walking is not Walking.UNSETTLED:
            return trial
        turn = replace(turn, planned=replace(turn.planned, cycles=min(2 * cycles, MAX_CYCLES)))


def planned_cycles(model: Model, gait: Gait, least: int) -> int:
    """Number of cycles to walk, at least `least`, by the model's prediction: near the edge a robot may hardly move for
    several cycles before it walks, so the first ones say little; one that never settles may fail after many."""
    if not settles(model):
        return MAX_CYCLES
    return int(np.clip(predict_speed(model, spread_of(model), gait).cycles, least, MAX_CYCLES))


def speed_of(trial: Trial) -> MeasuredSpeed:
    """Measured speed of one walk."""
    return measured_speed(trial.time_s, trial.columns["displacement_head_mm"], trial.walked["period_s"])


def walks_of(gait: Gait, dataset: Dataset) -> list[Trial]:
    """Trials of the data set that walked `gait`."""
    return [trial for trial in dataset.trials if trial.gait == gait.as_dict()]


def prediction_of(model: Model, trial: Trial, naive: bool = False) -> Prediction:
    """Predict the walk in `trial`, of which only the gait, the length and the clock rate are used; naive: from the
    model's covariance alone."""
    known, gait = spread_of(model), Gait(**trial.walked)
    cycles = max(complete_cycles(trial.time_s, gait.period_s), MIN_CYCLES)  # with fewer, `speed_of` raises
    rate = seconds_per_uno_s(trial)
    return predict_speed(model, known.naive if naive else known, gait, cycles=cycles, clock_rate=rate)


def predict(model: Model, trial: Trial) -> dict[str, Any]:
    """Simulate the walk in `trial`, with its switching of the valves: the same columns, on the trial's clock."""
    commands = valves_of(walk_timeline(trial), trial)
    columns = walk(model, commands=commands, time_s=trial.elapsed_s * seconds_per_uno_s(trial)).columns
    return dict(columns) | {"time_s": trial.time_s}
