"""Walk gaits on a rig and compare what was measured with what the model predicts."""

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path

from bifa.campaign.stages import Stage
from bifa.data import Dataset, Trial, read_dataset, write_dataset
from bifa.gait.measured import MeasuredSpeed, measured_speed
from bifa.link import Uno
from bifa.measure.locomotion import record_walk
from bifa.report.walks import MEASURED, Walk, draw_walks
from bifa.robot import Model
from bifa.robot.gait import Gait
from bifa.simulate import walk

Progress = Callable[[str, float], None]


def measure_walks(
    rig,
    gaits: Mapping[str, Gait],
    cycles: int,
    repeats: int = 1,
    on_progress: Progress = lambda what, share: None,
) -> Dataset:
    """Walk every gait `repeats` times on the rig; the trials of one data set, named after the gaits."""
    trials = []
    with Uno(rig.transport, rig.clock, rig.next_session_seed()) as uno:
        hello = uno.connect()
        uno.clear()
        for name, gait in gaits.items():
            for repeat in range(1, repeats + 1):
                recorded = record_walk(rig, uno, gait, cycles, lambda share, name=name: on_progress(name, share))
                trials.append(
                    Trial(
                        file=f"{name}_{repeat}.csv",
                        experiment="locomotion",
                        columns=recorded.columns,
                        gait=gait.as_dict(),
                        repeat=repeat,
                        session_order=len(trials) + 1,
                        extra=recorded.extra,
                    )
                )
    return Dataset(None, "walks", {}, tuple(trials), {"firmware": hello.firmware})


def speeds(dataset: Dataset) -> dict[str, list[MeasuredSpeed]]:
    """The measured speeds of each gait's repeats, by the name that `measure_walks` gave."""
    measured: dict[str, list[MeasuredSpeed]] = {}
    for trial in dataset.trials:
        speed = measured_speed(trial.time_s, trial.columns["displacement_head_mm"], trial.gait["period_s"])
        measured.setdefault(trial.file.rsplit("_", 1)[0], []).append(speed)
    return measured


def predict(model: Model, trial: Trial) -> dict:
    """The model's own record of the walk that `trial` holds: the same columns."""
    return walk(model, Gait(**trial.gait), time_s=trial.time_s).columns


def walks_stage(
    open_rig: Callable[[], object],
    gaits: Mapping[str, tuple[str, Gait]],
    cycles: int,
    model: Model,
    settings: Mapping[str, object],
    on_progress: Progress,
) -> Stage:
    """The stage that makes `walks` (data set), `walks.png` and `walks.json` (speeds).

    gaits: name -> (title for people, gait).
    """

    def run(inputs: Path, outputs: Path) -> None:
        with open_rig() as rig:
            dataset = measure_walks(rig, {name: gait for name, (_, gait) in gaits.items()}, cycles, 1, on_progress)
        write_dataset(outputs / "walks", dataset)
        dataset = read_dataset(outputs / "walks")
        measured = {name: [asdict(speed) for speed in repeats] for name, repeats in speeds(dataset).items()}
        (outputs / "walks.json").write_text(json.dumps(measured, indent=1) + "\n")
        columns = [
            Walk(
                gaits[trial.file.rsplit("_", 1)[0]][0],
                trial.gait["period_s"],
                {MEASURED: trial.columns, f"{model.name} model": predict(model, trial)},
            )
            for trial in dataset.trials
        ]
        draw_walks(columns, outputs / "walks.png")

    recorded = {name: gait.as_dict() for name, (_, gait) in gaits.items()}
    return Stage(
        "walk",
        "walk the gaits on the rig",
        (),
        ("walks", "walks.png", "walks.json"),
        run,
        dict(settings) | {"gaits": recorded, "cycles": cycles},
    )
