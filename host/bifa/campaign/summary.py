"""Summary of a campaign: predicted and measured speeds, errors before and after, report (the stage `compare`)."""

import json
import platform
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import bifa
from bifa.campaign.again import fastest_at_edge, read_rounds
from bifa.campaign.page import GAIT_NAMES, campaign_page, most_missed, motion_of
from bifa.campaign.stages import Stage
from bifa.campaign.walks import predict, prediction_of, speed_of, walks_of
from bifa.data import Dataset, Trial, read_dataset
from bifa.data.dataset import labels_of
from bifa.gait import simulations
from bifa.gait.metric import Metric
from bifa.gait.objectives import distribution
from bifa.gait.uncertainty import SPREAD, spread_of
from bifa.report.evidence import BASE, COMPLETED, errors_chart
from bifa.report.page import write_page
from bifa.report.picture import draw_chart
from bifa.report.walks import MEASURED, Walk, draw_walks
from bifa.robot import Model, load_model
from bifa.robot.gait import BASELINE, Gait, load_gait
from bifa.simulate import gait_rows
from bifa.toml import parse_toml

TITLES = {"baseline": "baseline gait"} | {which: f"gait {GAIT_NAMES[which]}" for which in ("base", "completed")}
_ROBOTS = 256
PAPER_MM_S = {"baseline": 10.8, "base": 23.3, "completed": 23.3, "edge": 23.3}


def summarize(sealed: bool, robot: str, made: Sequence[tuple[str, str]]) -> Stage:
    """Return the stage that makes `summary.json`, `report.html`, its two main figures and the animated walk.

    robot: in words; made: how the campaign was made, for the report."""
    needs = ["bench", "model-base.toml", "model-completed.toml", "walks-base", "walks-completed", "rounds.json"]
    needs += ["gait-base.toml", "gait-completed.toml", "rounds"]
    needs += ["diagnosis.json", "errors.json", "residuals.json", *(["truth.json"] if sealed else [])]
    makes = ("summary.json", "walks.png", "errors.png", "walk.svg", "report.html")
    return Stage("compare", "compare and report", tuple(needs), makes, partial(_run, robot, made))


def _run(robot: str, made: Sequence[tuple[str, str]], inputs: Path, outputs: Path) -> None:
    base, completed = (load_model(inputs / f"model-{which}.toml") for which in ("base", "completed"))
    datasets = {which: read_dataset(inputs / f"walks-{which}") for which in ("base", "completed")}
    walked = {
        "baseline": walks_of(BASELINE, datasets["base"]),
        "base": walks_of(load_gait(inputs / "gait-base.toml"), datasets["base"]),
        "completed": datasets["completed"].trials,
    }
    results = [
        _result(name, trials, base, _predicted(completed, trials[0]), _stand_in(inputs / f"gait-{name}.toml"))
        for name, trials in walked.items()
    ]
    rounds = read_rounds(inputs / "rounds.json")
    if number := fastest_at_edge(rounds):
        fastest = read_dataset(inputs / "rounds" / f"walks-{number}")
        results.append(_result("edge", fastest.trials, base, rounds[number - 1]))
    diagnosis, traces, errors = (
        json.loads((inputs / f"{name}.json").read_text()) for name in ("diagnosis", "residuals", "errors")
    )
    truth = json.loads((inputs / "truth.json").read_text()) if (inputs / "truth.json").exists() else None
    summary = {
        "gaits": results,
        **{name: diagnosis[name] for name in ("verdict", "effects", "remainder", "error")},
        "prediction_error": errors,
        "rounds": rounds,
        "robustness": _robustness(completed, {name: Gait(**trials[0].walked) for name, trials in walked.items()}),
        "truth": truth,
    }
    (outputs / "summary.json").write_text(json.dumps(summary, indent=1) + "\n")
    walks = {
        name: Walk(
            TITLES[name],
            first.walked["period_s"],
            {MEASURED: first.columns, COMPLETED: predict(completed, first), BASE: predict(base, first)},
        )
        for name, (first, *_) in walked.items()
    }
    draw_walks(list(walks.values()), outputs / "walks.png")
    draw_chart(errors_chart(diagnosis["error"]), outputs / "errors.png")
    (outputs / "walk.svg").write_text(motion_of(most_missed(walks), standalone=True)[0], encoding="utf-8")
    measured = read_dataset(inputs / "bench")
    versions = "versions", f"bifa {bifa.__version__}, Python {platform.python_version()}, NumPy {np.__version__}"
    about = [*_measurement_info(measured), *made, versions]
    page = campaign_page(summary, diagnosis, traces, walks, labels_of(measured), robot, about)
    write_page(page, outputs / "report.html")


def _predicted(model: Model, trial: Trial) -> dict[str, Any]:
    """Prediction of a trial's gait, as in a round."""
    found = prediction_of(model, trial)
    return {
        "predicted_mm_s": found.speed_mm_s,
        "interval_90_mm_s": found.interval_90_mm_s,
        "walks_probability": found.walks_probability,
    }


def _stand_in(file: Path) -> str | None:
    """Whose gait the file of a model's gait holds if none walks on that model: "baseline" or "base"; otherwise None."""
    if not file.exists() or "instead_of" not in parse_toml(file.read_text("utf-8")).get("provenance", {}):
        return None
    return "baseline" if load_gait(file) == BASELINE else "base"


def _result(
    gait: str, trials: Sequence[Trial], base: Model, predicted: Mapping[str, Any], stand_in: str | None = None
) -> dict[str, Any]:
    """Speeds in mm/s over the settled cycles of a gait. spread: standard deviation of the repeats. settled_cycles:
    number measured in all. completed_model, interval_90_mm_s, walks_probability: as `predicted` by the completed model,
    at the edge by the model that sought the gait. stand_in: the gait walked instead if none walks on the model.
    """
    measured, trial = [speed_of(one) for one in trials], trials[0]
    means = [speed.mean_mm_s for speed in measured]
    return {
        "gait": gait,
        "base_model": prediction_of(base, trial).speed_mm_s,
        "completed_model": predicted["predicted_mm_s"],
        "measured": float(np.mean(means)),
        "spread": float(np.std(means, ddof=1)) if len(means) > 1 else 0.0,
        "paper": PAPER_MM_S[gait],
        "stand_in": stand_in,
        "settled_cycles": sum(speed.settled_cycles for speed in measured),
        "interval_90_mm_s": predicted["interval_90_mm_s"],
        "walks_probability": predicted["walks_probability"],
    }


def _measurement_info(measured: Dataset) -> list[tuple[str, str]]:
    """The day (UTC) on which the data were measured, unless on a virtual robot, and with which firmware."""
    noted = measured.provenance
    day, firmware = str(noted.get("recorded_at", ""))[: len("2026-11-29")], str(noted.get("firmware", ""))
    return [(name, value) for name, value in (("measured", day), ("firmware", firmware)) if value]


def _robustness(model: Model, gaits: Mapping[str, Gait]) -> dict[str, list[float]]:
    """Sorted speeds in mm/s of each gait on robots whose parameters differ from the model by `SPREAD`."""
    robots = spread_of(model, SPREAD).plants(model, _ROBOTS, 0)
    with simulations() as runs:
        speeds = distribution(runs, robots, gait_rows(list(gaits.values())), Metric())
    return {name: [round(float(v), 2) for v in np.sort(row)] for name, row in zip(gaits, speeds, strict=True)}
