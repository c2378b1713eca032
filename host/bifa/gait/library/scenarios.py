"""Scenarios of the library: the purpose of each gait and the settings of the search that finds it."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bifa.gait.library import NAMES
from bifa.gait.metric import Metric, Passage
from bifa.gait.search import Optimum, Settings
from bifa.gait.space import paper_space
from bifa.robot.gait import save_gait


@dataclass(frozen=True)
class Scenario:
    """Purpose of a gait and the settings of its search."""

    name: str
    purpose: str
    settings: Settings = field(default_factory=Settings)


SCENARIOS: dict[str, Scenario] = {
    scenario.name: scenario
    for scenario in (
        Scenario("fast", "the fastest on the model itself; brittle", Settings(robust=False)),
        Scenario("robust", "the fastest that nine robots in ten reach"),
        Scenario(
            "obstacle",
            "through the paper's 97 mm tunnel: full strokes, so that the supports bend",
            Settings(metric=Passage(), space=paper_space(period_s=(4.0, 8.0))),
        ),
        Scenario(
            "vertical",
            "straight up a pipe",
            Settings(metric=Metric(inclination_deg=90.0), space=paper_space(period_s=(2.0, 6.0))),
        ),
        Scenario("backward", "out again, tail first", Settings(metric=Metric(direction=-1))),
        Scenario(
            "quiet",
            "at most three valve switches in four seconds: a period of 8 s or more",
            Settings(space=paper_space(period_s=(8.0, 12.0))),
        ),
    )
}


assert tuple(SCENARIOS) == NAMES


def provenance(optimum: Optimum, model_name: str, made_by: str) -> dict[str, Any]:
    """Provenance table of a gait file: model, search, predicted speeds."""
    settings = optimum.settings
    return {
        "made_by": made_by,
        "model": model_name,
        "method": settings.method,
        "seed": settings.seed,
        "objective": settings.aim,
        "evaluations": optimum.evaluations,
        "simulations": optimum.simulations,
        "predicted_speed_mm_s": round(optimum.nominal_mm_s, 3),
        "predicted_10th_percentile_mm_s": round(optimum.percentile_10_mm_s, 3),
        "interval_90_mm_s": [round(v, 3) for v in optimum.prediction.interval_90_mm_s],
        "walks_probability": round(optimum.prediction.walks_probability, 4),
        "cycles_to_settle": optimum.prediction.cycles,
        "uncertainty": optimum.spread.text,
    }


def save(folder: Path, scenario: Scenario, optimum: Optimum, model_name: str) -> Path:
    """Write the gait of a scenario into `folder`."""
    path = folder / f"{scenario.name}.toml"
    notes = provenance(optimum, model_name, "bifa gaits --make")
    save_gait(path, optimum.gait, {"scenario": scenario.name, "purpose": scenario.purpose, **notes})
    return path
