"""What a campaign comes to: speeds predicted and measured, errors before and after, and the report."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from bifa.campaign.page import campaign_page
from bifa.campaign.stages import Stage
from bifa.campaign.walks import predict, speeds
from bifa.data import Trial, read_dataset
from bifa.gait.measured import measured_speed
from bifa.report.page import render
from bifa.report.walks import Walk, draw_walks
from bifa.robot import Model, load_model

TITLES = {
    "baseline": "baseline gait",
    "base": "gait from the base model",
    "completed": "gait from the completed model",
}
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
    """The stage that makes `summary.json`, `report.html` and `walks.png`."""
    needs = ("model-base.toml", "model-completed.toml", "walks-base", "walks-completed", "diagnosis.json")
    if sealed:
        needs = (*needs, "truth.json")
    return Stage("compare", "compare and report", needs, ("summary.json", "walks.png", "report.html"), _run)


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
    truth = json.loads((inputs / "truth.json").read_text()) if (inputs / "truth.json").exists() else None
    summary = {
        "gaits": [asdict(result) for result in results],
        "verdict": diagnosis["verdict"],
        "effects": diagnosis["effects"],
        "error": diagnosis["error"],
        "truth": truth,
    }
    (outputs / "summary.json").write_text(json.dumps(summary, indent=1) + "\n")
    columns = [
        Walk(TITLES[t.file.rsplit("_", 1)[0]], t.gait["period_s"], t.columns, predict(completed, t))
        for t in trials
        if t.repeat == 1
    ]
    draw_walks(columns, outputs / "walks.png")
    (outputs / "report.html").write_text(render(campaign_page(summary, diagnosis, columns)))


def predicted_speed(model: Model, trial: Trial) -> float:
    """The settled speed that the model gives to the walk in `trial`, judged as the measured one is; mm/s."""
    columns = predict(model, trial)
    return measured_speed(columns["time_s"], columns["displacement_head_mm"], trial.gait["period_s"]).mean_mm_s
