"""What a campaign comes to: speeds predicted and measured, errors before and after, and the report."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from bifa.campaign.page import campaign_page
from bifa.campaign.stages import Stage
from bifa.campaign.walks import predict, speeds
from bifa.data import Trial, read_dataset
from bifa.gait import simulations
from bifa.gait.measured import measured_speed
from bifa.gait.metric import Metric
from bifa.gait.objectives import distribution
from bifa.gait.uncertainty import SPREAD, spread_of
from bifa.report.walks import Walk, draw_walks
from bifa.robot import Model, load_model
from bifa.robot.gait import Gait
from bifa.simulate import gait_rows
from lacuna.report.evidence import draw_errors
from lacuna.report.page import render

TITLES = {
    "baseline": "baseline gait",
    "base": "gait from the base model",
    "completed": "gait from the completed model",
}
_ROBOTS = 256
PAPER_MM_S = {"baseline": 10.8, "base": 23.3, "completed": 23.3}


@dataclass(frozen=True)
class GaitResult:
    """Speeds in mm/s over the settled cycles; `spread` is that of the repeats."""

    gait: str
    base_model: float
    completed_model: float
    measured: float
    spread: float
    paper: float


def compare(sealed: bool) -> Stage:
    """The stage that makes `summary.json`, `report.html` and its two main figures."""
    needs = ["model-base.toml", "model-completed.toml", "walks-base", "walks-completed"]
    needs += ["diagnosis.json", "errors.json", "residuals.json", *(["truth.json"] if sealed else [])]
    makes = ("summary.json", "walks.png", "errors.png", "report.html")
    return Stage("compare", "compare and report", tuple(needs), makes, _run)


def _run(inputs: Path, outputs: Path) -> None:
    base, completed = (load_model(inputs / f"model-{which}.toml") for which in ("base", "completed"))
    datasets = [read_dataset(inputs / f"walks-{which}") for which in ("base", "completed")]
    trials = [trial for dataset in datasets for trial in dataset.trials]
    results = []
    for dataset in datasets:
        for gait, repeats in speeds(dataset).items():
            means = [speed.mean_mm_s for speed in repeats]
            trial = next(t for t in dataset.trials if t.file.startswith(f"{gait}_"))
            results.append(
                GaitResult(
                    gait,
                    predicted_speed(base, trial),
                    predicted_speed(completed, trial),
                    float(np.mean(means)),
                    float(np.std(means, ddof=1)) if len(means) > 1 else 0.0,
                    PAPER_MM_S[gait],
                )
            )
    diagnosis = json.loads((inputs / "diagnosis.json").read_text())
    traces = json.loads((inputs / "residuals.json").read_text())
    truth = json.loads((inputs / "truth.json").read_text()) if (inputs / "truth.json").exists() else None
    summary = {
        "gaits": [asdict(result) for result in results],
        "verdict": diagnosis["verdict"],
        "effects": diagnosis["effects"],
        "remainder": diagnosis["remainder"],
        "error": diagnosis["error"],
        "prediction_error": json.loads((inputs / "errors.json").read_text()),
        "robustness": _robustness(completed, trials),
        "truth": truth,
    }
    (outputs / "summary.json").write_text(json.dumps(summary, indent=1) + "\n")
    columns = [
        Walk(TITLES[t.file.rsplit("_", 1)[0]], t.gait["period_s"], t.columns, predict(completed, t))
        for t in trials
        if t.repeat == 1
    ]
    draw_walks(columns, outputs / "walks.png")
    draw_errors(diagnosis["error"], outputs / "errors.png")
    (outputs / "report.html").write_text(render(campaign_page(summary, diagnosis, traces, columns)))


def _robustness(model: Model, trials: list[Trial]) -> dict[str, list[float]]:
    """Speeds in mm/s of every gait on robots that differ from the model by `SPREAD` in each parameter, sorted."""
    gaits = {trial.file.rsplit("_", 1)[0]: Gait(**trial.gait) for trial in trials}
    robots = spread_of(model, SPREAD).plants(model, _ROBOTS, 0)
    with simulations() as runs:
        speeds = distribution(runs, robots, gait_rows(list(gaits.values())), Metric())
    return {name: [round(float(v), 2) for v in np.sort(row)] for name, row in zip(gaits, speeds, strict=True)}


def predicted_speed(model: Model, trial: Trial) -> float:
    """The settled speed that the model gives to the walk in `trial`, judged as the measured one is; mm/s."""
    columns = predict(model, trial)
    return measured_speed(columns["time_s"], columns["displacement_head_mm"], trial.gait["period_s"]).mean_mm_s
