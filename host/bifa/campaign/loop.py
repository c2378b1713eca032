"""The stages of a campaign: measure, fit, walk, diagnose, optimise the completed model, walk again, compare."""

import json
from collections.abc import Collection
from dataclasses import asdict, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from bifa.campaign.again import RoundSteps, again
from bifa.campaign.before_and_after import prediction_errors, residuals
from bifa.campaign.resolve import finished, joined, resolve
from bifa.campaign.setup import Effort, Setup, about
from bifa.campaign.stages import OnProgress, Stage
from bifa.campaign.summary import summarize
from bifa.campaign.walks import measure_walks, planned_cycles
from bifa.data import Dataset, read_dataset, write_dataset
from bifa.data.dataset import labels_of
from bifa.gait import Optimum, SearchError, Settings, optimize, simulations
from bifa.gait.library.scenarios import provenance
from bifa.gait.uncertainty import SPREAD
from bifa.identify.completed import completed_model
from bifa.identify.doubts import with_doubts
from bifa.identify.identification import identify
from bifa.identify.refit import refitted
from bifa.identify.start import before_fit, prepare
from bifa.measure import plan
from bifa.measure.session import run_session
from bifa.report.words import spoken
from bifa.robot import Model, load_model, save_model
from bifa.robot.gait import BASELINE, Gait, load_gait, save_gait
from lacuna.diagnosis.diagnose import Diagnosis, diagnose
from lacuna.diagnosis.next_experiment import NextExperiment
from lacuna.diagnosis.record import as_record
from lacuna.diagnosis.workers import STOPPED

BENCH_NAME = "campaign: characterisation"  # name of the data set `bench`
_MIN_WALK_PROBABILITY = 0.5  # gaits at the edge with a lower probability of walking are not tried
_SEPARATING_STAGE = 10  # stage numbers of the rig: experiments that separate confusable effects count from here,
_ROUND_STAGE = 20  # and the walks of further rounds from here


def campaign(setup: Setup, effort: Effort, on_progress: OnProgress) -> list[Stage]:
    """Return the stages of a campaign on `setup`; `on_progress(what, share)` reports the progress of the running stage.

    With instruments worked by hand, only the stages that measure need the robot: the diagnosis names the experiment
    that would separate effects it confuses, and leaves the decision to the person.
    """
    # no bar over the questions to a person at the bench
    on_trial: OnProgress = (lambda what, share: None) if setup.is_by_hand else on_progress
    stages = [
        *_characterize(setup, effort, on_trial),
        _fit(on_progress),
        _optimize("base", (), setup, on_progress),
        _walk("base", {"baseline": None, "base": "gait-base.toml"}, 1, setup, effort, on_trial),
        _diagnose(setup, on_progress),
        _optimize("completed", ("gait-base.toml",), setup, on_progress),
        _walk("completed", {"completed": "gait-completed.toml"}, 2, setup, effort, on_trial),
        _feed_back(setup, effort, on_progress, on_trial),
    ]
    if setup.is_virtual:
        stages.append(_unseal(setup))
    stages.append(summarize(setup.is_virtual, *about(setup, effort)))
    return stages


def _characterize(setup: Setup, effort: Effort, on_trial: OnProgress) -> list[Stage]:
    """On a real robot the person's known values are not part of the measurement; a second stage declares them, so that
    correcting one does not require measuring again."""
    kept, trials = not setup.is_virtual, plan.session(quick=effort.quick)
    data, known = ("measured", {}) if kept else ("bench", dict(setup.known))

    def run(inputs: Path, outputs: Path) -> None:
        # the same seed gives the same bytes, so a virtual robot's data have no date
        day = {"recorded_at": datetime.now(UTC).isoformat(timespec="seconds")} if kept else {}
        with setup.open(0) as rig:
            run_session(
                rig,
                outputs / data,
                trials,
                name="campaign" if kept else BENCH_NAME,
                known={**rig.known, **known},
                provenance=setup.settings(0) | day,
                record=setup.hands,
                on_event=lambda e: on_trial(e.planned.title, (e.number - 1 + e.share) / e.total),
            )

    title = f"characterise the robot: {len(trials)} trials" if kept else "characterise the robot on its bench"
    settings = setup.settings(0) | {"effort": asdict(effort)} | ({} if kept else {"known": known})
    measure = Stage("measure", title, (), (data,), run, settings, resumes=True, by_hand=kept)
    return [measure, _declare(setup)] if kept else [measure]


def _declare(setup: Setup) -> Stage:
    """Add the values that the person knows, which take precedence over those that the rig declares."""

    def run(inputs: Path, outputs: Path) -> None:
        measured = read_dataset(inputs / "measured")
        known = {**measured.known, **setup.known}
        write_dataset(outputs / "bench", replace(measured, name=BENCH_NAME, known=known))

    return Stage("declare", "declare what is known", ("measured",), ("bench",), run, {"known": dict(setup.known)})


def _fit(on_progress: OnProgress) -> Stage:
    def run(inputs: Path, outputs: Path) -> None:
        found = identify(read_dataset(inputs / "bench"), on_progress=lambda what: on_progress(what, 0.0))
        save_model(outputs / "model-base.toml", found.model)

    return Stage("fit", "fit the base model", ("bench",), ("model-base.toml",), run)


def _optimize(which: str, walked: tuple[str, ...], setup: Setup, on_progress: OnProgress) -> Stage:
    """Find the gait of the base or the completed model; the search also starts from the gaits `walked` before."""
    model, gait = f"model-{which}.toml", f"gait-{which}.toml"

    def run(inputs: Path, outputs: Path) -> None:
        begin = tuple(load_gait(inputs / file) for file in walked)
        save_gait(outputs / gait, *_gait_of(load_model(inputs / model), setup, on_progress, begin))

    settings = {"seed": setup.seed, "spread": SPREAD}
    return Stage(f"optimise-{which}", f"gait from the {which} model", (model, *walked), (gait,), run, settings)


def _gait_of(
    robot: Model, setup: Setup, on_progress: OnProgress, walked: tuple[Gait, ...]
) -> tuple[Gait, dict[str, Any]]:
    """Return the robust gait found with a model, and its provenance. A base model that lacks much, or a robot on a
    shaking bench, may have no gait that walks; the gait walked last, or the baseline, then stands in for it."""
    try:
        best = found_gait(robot, setup.seed, SPREAD, on_progress, walked)
    except SearchError as error:
        return (BASELINE, *walked)[-1], {"made_by": "bifa campaign", "instead_of": f"a gait of {robot.name}: {error}"}
    return best.gait, provenance(best, robot.name, "bifa campaign")


def gait_at_edge(robot: Model, seed: int, on_progress: OnProgress, walked: tuple[Gait, ...]) -> Gait | None:
    """Find the gait for what is known of the model; None if there is none or the model expects it not to walk."""
    try:
        best = found_gait(robot, seed, None, on_progress, walked)
    except SearchError:
        return None
    return best.gait if best.prediction.walks_probability >= _MIN_WALK_PROBABILITY else None


def found_gait(
    robot: Model,
    seed: int,
    spread: float | None,
    on_progress: OnProgress,
    walked: tuple[Gait, ...] = (),
    naive: bool = False,
) -> Optimum:
    """Find the gait that is fastest on average among those with which 19 in 20 robots drawn from what is known walk
    (`spread` None), or the fastest for nine in ten with the relative `spread`. The search also starts from the baseline
    and from the gaits `walked` before."""
    settings = Settings(seed=seed, spread=spread, naive=naive, at_edge=spread is None, begin=(BASELINE, *walked))
    with simulations() as runs:
        return optimize(robot, runs, settings, lambda what, share, _: on_progress(what, share))


def _walk(
    which: str, gaits: dict[str, str | None], number: int, setup: Setup, effort: Effort, on_trial: OnProgress
) -> Stage:
    """Walk gaits, each for as many cycles as the model `which` takes to settle with it."""
    name, walks, model = f"walk-{which}", f"walks-{which}", f"model-{which}.toml"

    def run(inputs: Path, outputs: Path) -> None:
        loaded = {key: load_gait(inputs / file) if file else BASELINE for key, file in gaits.items()}
        robot = load_model(inputs / model)
        cycles = {key: planned_cycles(robot, gait, effort.cycles) for key, gait in loaded.items()}
        with setup.open(number) as rig:
            measure_walks(rig, outputs / walks, loaded, cycles, effort.repeats, on_trial, setup.hands)

    needs = (model, *(file for file in gaits.values() if file))
    settings = setup.settings(number) | {"effort": asdict(effort)}
    title, kept = f"walk: {' and '.join(gaits)}", not setup.is_virtual
    return Stage(name, title, needs, (walks,), run, settings, resumes=kept, by_hand=kept)


def _run_diagnosis(
    setup: Setup, on_progress: OnProgress, dataset: Dataset, suspected: Collection[str] = (), begin: Model | None = None
) -> Diagnosis:
    system, on_step = prepare(dataset, begin), lambda what: on_progress(spoken(what), 0.0)
    found = diagnose(system, seed=setup.seed, suspected=suspected, on_progress=on_step)
    return with_doubts(found, system)


def _diagnose(setup: Setup, on_progress: OnProgress) -> Stage:
    diagnosed = partial(_run_diagnosis, setup, on_progress)

    def run(inputs: Path, outputs: Path) -> None:
        dataset = read_dataset(inputs / "bench")
        found = diagnosed(dataset)
        (outputs / "separating").mkdir(exist_ok=True)
        ran: tuple[NextExperiment, ...] = ()
        if not setup.is_by_hand:
            rigs, folder = (lambda n: setup.open(_SEPARATING_STAGE + n)), outputs / "separating"
            dataset, found, ran = resolve(dataset, found, diagnosed, rigs, folder, on_progress)
        record = as_record(found) | {"separated_by": [asdict(experiment) for experiment in ran]}
        del record["seconds"]  # the same seed gives the same bytes
        (outputs / "diagnosis.json").write_text(json.dumps(record, indent=1) + "\n")
        (outputs / "errors.json").write_text(json.dumps(prediction_errors(found), indent=1) + "\n")
        (outputs / "residuals.json").write_text(json.dumps(residuals(found, labels_of(dataset))) + "\n")
        save_model(outputs / "model-completed.toml", completed_model(found.told))

    makes = ("diagnosis.json", "errors.json", "residuals.json", "model-completed.toml", "separating")
    settings = setup.settings(_SEPARATING_STAGE) | {"search_seed": setup.seed}
    measures = not (setup.is_virtual or setup.is_by_hand)  # the separating experiments, on an unattended rig
    title = "find what the model lacks"
    return Stage("diagnose", title, ("bench",), makes, run, settings, resumes=measures, by_hand=measures)


def _feed_back(setup: Setup, effort: Effort, on_progress: OnProgress, on_trial: OnProgress) -> Stage:
    def complete(dataset: Dataset, model: Model) -> Model:
        known = refitted(dataset, model, setup.seed, lambda what: on_progress(spoken(what), 0.0))
        if known:
            return known
        found = _run_diagnosis(setup, on_progress, dataset, tuple(model.effects), before_fit(model))
        if STOPPED in found.warnings:  # a round leaves no record of it: the stage is resumed or begun again instead
            raise KeyboardInterrupt
        return completed_model(found.told)

    def walk(number: int, model: Model, gait: Gait, folder: Path) -> Dataset:
        cycles = planned_cycles(model, gait, effort.cycles)
        with setup.open(_ROUND_STAGE + number) as rig:
            gaits = {f"round-{number}": gait}
            return measure_walks(rig, folder, gaits, cycles, effort.repeats, on_trial, setup.hands)

    def run(inputs: Path, outputs: Path) -> None:
        dataset = read_dataset(inputs / "bench")
        for name in finished(inputs / "separating"):
            dataset = joined(dataset, read_dataset(inputs / "separating" / name), f"{name}_")
        steps = RoundSteps(complete, lambda robot, walked: gait_at_edge(robot, setup.seed, on_progress, walked), walk)
        again(inputs, outputs, dataset, steps)

    walked = ("walks-base", "walks-completed")
    needs = ("bench", "separating", *walked, "model-completed.toml", "gait-completed.toml")
    makes = ("rounds.json", "rounds", "model-last.toml", "gait-last.toml")
    settings = setup.settings(_ROUND_STAGE) | {"effort": asdict(effort), "search_seed": setup.seed}
    kept = not setup.is_virtual
    return Stage("again", "feed the walks back", needs, makes, run, settings, resumes=kept, by_hand=kept)


def _unseal(setup: Setup) -> Stage:
    def run(inputs: Path, outputs: Path) -> None:
        virtual: Any = setup.open(0)
        with virtual as rig:
            (outputs / "truth.json").write_text(json.dumps(rig.open_seal(), indent=1) + "\n")

    return Stage("unseal", "open the seal", ("diagnosis.json",), ("truth.json",), run, setup.settings(0))
