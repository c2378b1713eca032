"""Run the experiment that separates effects a diagnosis could not, and diagnose again."""

from collections.abc import Callable, Collection
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

from bifa.campaign.stages import OnProgress
from bifa.data import Dataset, DatasetError, read_dataset
from bifa.measure.plan import REPEATS, PlannedTrial
from bifa.measure.session import Recorder, run_session
from bifa.rig import Rig
from bifa.robot.gait import Gait
from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.diagnosis.next_experiment import NextExperiment

ROUNDS = 3
SPECIMEN = ("sealed", "profile", "effects", "parameters")  # options of a virtual rig that determine which robot it is
_WALK_CYCLES = 4
_MOVE_AWAY = "move it away, to keep it, and run the command again"


def resolve(
    dataset: Dataset,
    found: Diagnosis,
    diagnose: Callable[[Dataset, Collection[str]], Diagnosis],
    open_rig: Callable[[int], AbstractContextManager[Rig]],
    folder: Path,
    on_progress: OnProgress = lambda what, share: None,
    record: Recorder | None = None,
) -> tuple[Dataset, Diagnosis, tuple[NextExperiment, ...]]:
    """As long as `found` names an experiment that separates the effects it confuses, run it and diagnose again, up to
    `ROUNDS` times. This ends when one explanation is left or no available experiment separates them.

    open_rig(n) opens the rig for experiment n, counted from 1; its data set goes to `folder`/separate-n. One that is
    there, from a run that was interrupted, is not measured again. Raises DatasetError if it holds other trials than are
    asked for now, as with a newer version.
    diagnose(dataset, suspected): `suspected` are the effects named before and those they were confused with. Returns
    all trials as one data set, the last diagnosis, and the experiments that were run.
    """
    ran: list[NextExperiment] = []
    for number in range(1, ROUNDS + 1):
        if found.next.experiment is None:
            break
        target = folder / f"separate-{number}"
        if not target.exists():
            with open_rig(number) as rig:
                run_session(
                    rig,
                    target,
                    planned(found.next),
                    name=f"to tell {' and '.join(found.next.separates)} apart",
                    known=dataset.known,
                    provenance=dataset.provenance,
                    record=record,
                    on_event=lambda e: on_progress(e.planned.title, (e.number - 1 + e.share) / e.total),
                )
        measured = read_dataset(target)
        if {trial.condition for trial in measured.trials} != {
            trial.as_trial().condition for trial in planned(found.next)
        }:
            raise DatasetError(f"{target} holds other trials than this diagnosis asks for: {_MOVE_AWAY}")
        dataset = joined(dataset, measured, f"{target.name}_")
        ran.append(found.next)
        found = diagnose(dataset, {*found.next.separates, *(effect.name for effect in found.effects)})
    if left := finished(folder)[len(ran) :]:
        raise DatasetError(f"{folder} holds {', '.join(left)}, which this diagnosis does not ask for: {_MOVE_AWAY}")
    return dataset, found, tuple(ran)


def refuse_leftovers(folder: Path) -> None:
    """Raise DatasetError if an earlier `resolve` left an experiment, before minutes are spent on a diagnosis."""
    if left := finished(folder):
        raise DatasetError(f"{folder} holds {', '.join(left)} from an earlier --resolve: move that folder away first")


def finished(folder: Path) -> list[str]:
    """Names of the experiments that a `resolve` has finished in `folder`."""
    return sorted(path.name for path in folder.glob("separate-*") if path.suffix != ".partial")


def planned(chosen: NextExperiment) -> tuple[PlannedTrial, ...]:
    """Return the trials of the chosen experiment, repeats included."""
    settings = chosen.settings
    if chosen.experiment is None:
        raise ValueError("no experiment was chosen")
    gait = Gait(**settings["gait"]) if "gait" in settings else None
    actuator, pressure_psi, rate_mm_s = (settings.get(key) for key in ("actuator", "pressure_psi", "rate_mm_s"))
    stand = {key: settings[key] for key in ("direction", "inclination_deg") if key in settings}
    cycles = _WALK_CYCLES if gait else 0
    condition = PlannedTrial(chosen.experiment, actuator, pressure_psi, rate_mm_s, gait, cycles, settings=stand)
    return tuple(replace(condition, repeat=repeat) for repeat in range(1, REPEATS + 1))


def joined(first: Dataset, second: Dataset, prefix: str) -> Dataset:
    """Join the trials of two data sets into one session; those of the second come later and get the prefix."""
    last = max((t.session_order or 0 for t in first.trials), default=0)
    later = tuple(
        replace(
            trial,
            file=prefix + trial.file,
            repeat=trial.repeat + first.last_repeat(trial.condition),
            session_order=last + (trial.session_order or 1),
        )
        for trial in second.trials
    )
    return Dataset(None, first.name, first.known, first.trials + later, first.provenance)
