"""A session at the bench: record the planned trials one by one into a data set that grows on disk.

An interrupted session can be resumed; a finished data set is never overwritten; however a session ends, the valves
are off afterwards.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import bifa
from bifa.check.lag import trial_misfit
from bifa.data import Dataset, DatasetError, DatasetWriter, Trial
from bifa.errors import BifaError
from bifa.link import Uno
from bifa.link.session import Counters
from bifa.lock import locked
from bifa.measure.experiments import Progress, record_trial
from bifa.measure.plan import PlannedTrial, Turn
from bifa.measure.recording import bench_of
from bifa.printable import counted
from bifa.rig import Rig


@dataclass(frozen=True)
class Event(Turn):
    """Progress of a session: `share` of the trial is done. For a finished trial also the `trial`, the `link` counters
    over its duration, and a description of its displacement's lag if that does not match the earlier trials (`misfit`).
    """

    share: float = 0.0
    trial: Trial | None = None
    link: Counters | None = None
    misfit: str | None = None


# Records one planned trial for the data set that the writer is writing.
Recorder = Callable[[Rig, Uno, Turn, Progress, DatasetWriter], Trial]


def unattended(rig: Rig, uno: Uno, turn: Turn, on_progress: Progress, writer: DatasetWriter) -> Trial:
    """The `Recorder` of a rig whose instruments run unattended."""
    return record_trial(bench_of(rig), uno, turn.planned, on_progress)


def run_session(
    rig: Rig,
    folder: Path,
    trials: Sequence[PlannedTrial],
    *,
    name: str,
    known: Mapping[str, float],
    provenance: Mapping[str, Any],
    record: Recorder | None = None,
    on_event: Callable[[Event], None] = lambda event: None,
) -> Dataset:
    """Record `trials` on `rig` into `folder`, skipping those that an interrupted session has already recorded.
    `record`: None if the rig's instruments run unattended.

    Raises DatasetError if `folder` is a finished data set, or an unfinished one of another session or with other
    `options` in its provenance; LockedError if another process is recording into it.
    """
    _refuse_same_names(trials)
    with locked(folder):
        with Uno(rig.transport, rig.clock, rig.next_session_seed()) as uno:
            hello = uno.connect()
            writer = DatasetWriter(folder, name, known, {**provenance, "firmware": hello.firmware}, resume=True)
            refuse_other_settings(writer, provenance)
            if writer.trials:
                rig.resume(len(writer.trials))
            if uno.may_move:  # not every port restarts the Uno, and somebody may be asked to reach into the stand
                uno.halt()
            uno.clear()
            supplied = _at_own_pressure(trials, uno.get("pressure_psi"))
            for number, planned in enumerate(supplied, start=1):
                if writer.has(planned.as_trial()):
                    continue
                before, event = replace(uno.counters), Event(planned, number, len(trials))
                on_event(event)

                def on_progress(share: float, event: Event = event) -> None:
                    on_event(replace(event, share=share))

                trial = (record or unattended)(rig, uno, event, on_progress, writer)
                writer.add(replace(trial, session_order=number))
                link, misfit = uno.counters.since(before), trial_misfit(trial, writer.trials[:-1])
                on_event(replace(event, share=1.0, trial=trial, link=link, misfit=misfit))
        return writer.finish()


def _at_own_pressure(trials: Sequence[PlannedTrial], own_psi: float) -> list[PlannedTrial]:
    """The trials, with walks that plan no pressure at the Uno's own, whatever a trial before them has set. Raises
    BifaError if there are walks at 0 psi, which some start presets have for safety."""
    supplied = [
        replace(trial, parameters={"pressure_psi": own_psi, **trial.parameters}) if trial.gait is not None else trial
        for trial in trials
    ]
    if any(trial.parameters.get("pressure_psi") == 0.0 for trial in supplied):
        raise BifaError(
            "the set-point is 0 psi, with which nothing walks: set it in `bifa console` (`set pressure_psi 8.5`, then "
            "`save`), or give `bifa experiment` a `--pressure`"
        )
    return supplied


def _refuse_same_names(trials: Sequence[PlannedTrial]) -> None:
    """Raise DatasetError if different trials would have the same file: names show six digits of a condition."""
    planned: dict[str, PlannedTrial] = {}
    for trial in trials:
        other = planned.setdefault(trial.file, trial)
        if other.as_trial().condition != trial.as_trial().condition:
            raise DatasetError(
                f"{trial.file} would be the file of two trials, whose conditions differ by less than its name shows; "
                "leave one out, or record them into two data sets"
            )


def refuse_other_settings(writer: DatasetWriter, provenance: Mapping[str, Any]) -> None:
    """Raise DatasetError if the trials left by an interrupted session were recorded with other options: the data set
    would mix both, but its provenance would name only the first."""
    if not writer.trials:
        return
    old, new = (_settings(of) for of in (writer.provenance, provenance))
    differing = [
        f"{name} = {old.get(name, 'none')}, not {new.get(name, 'none')}"
        for name in sorted(old.keys() | new.keys())
        if old.get(name) != new.get(name)
    ]
    if differing:
        raise DatasetError(
            f"{writer.partial} holds {counted(len(writer.trials), 'trial')} made with {', '.join(differing)}: "
            "resume with the same options, choose another folder, or move it away"
        )


def _settings(provenance: Mapping[str, Any]) -> dict[str, Any]:
    """The settings that affect a session's data: the options and whether the robot is virtual, but not its port."""
    return {"virtual": provenance.get("port") == "virtual"} | dict(provenance.get("options", {}))


def provenance(command: str, port: str | None, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the provenance of a data set: command and version, time, port and options."""
    return {
        "recorded_by": f"{command} {bifa.__version__}",
        "recorded_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "port": port or "found by USB identity",
        "options": {key: value for key, value in options.items() if value is not None},
    }
