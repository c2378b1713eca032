"""Whether the probability of walking is calibrated where it matters: at the cliff, robot by robot.

    python -m benchmarks.cliff [--out ../out/loop] [--records FILE] [--print]

For every campaign that `benchmarks.loop` of this version has left in OUT, the last gait is made faster until, by the
last model, nearly all, most, half and few of the possible robots walk with it. Each such gait is walked `RUNS` times,
through the real firmware. FILE has one line per robot, with which an interrupted run resumes.
"""

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np

from benchmarks import loop
from benchmarks import records as lines
from benchmarks.search_record import version
from bifa.campaign.walks import measure_walks, speed_of
from bifa.gait.prediction import MIN_SPEED_RATIO, Prediction, Predictor
from bifa.gait.settling import STANDING_MM_S
from bifa.gait.uncertainty import spread_of
from bifa.robot import Model, load_model
from bifa.robot.gait import Gait

WANTED = (0.95, 0.8, 0.5, 0.2, 0.05)
RUNS = 6
_MOST_FASTER = 0.15  # share of the period, within which the cliff is searched for
_HALVINGS = 12
_CYCLES = 12
_STAGE = 70  # the first of the rig's numbers for these walks


@dataclass(frozen=True)
class Step:
    """One gait: the share by which its period is shorter, the predicted probability of walking and interval, and the
    speeds of its runs; `walked`: which of them walk."""

    faster: float
    probability: float
    interval_90_mm_s: tuple[float, float]
    runs_mm_s: tuple[float, ...]
    walked: tuple[bool, ...]


def at_the_cliff(model: Model, gait: Gait) -> list[tuple[float, Prediction]]:
    """Shares by which the period is shorter, and the prediction there, for each of the probabilities `WANTED`; empty
    for a gait with which more than the lowest of these walk, however fast."""
    predictor = Predictor(model, spread_of(model))

    def predicted(faster: float) -> Prediction:
        return predictor.of(replace(gait, period_s=gait.period_s * (1.0 - faster)), cycles=_CYCLES)

    least = MIN_SPEED_RATIO * predicted(0.0).speed_mm_s  # a robot that falls may still creep

    def share(faster: float) -> float:
        return float(np.mean(predicted(faster).speeds_mm_s >= least))

    if share(_MOST_FASTER) > WANTED[-1]:
        return []
    found = []
    for wanted in WANTED:
        low, high = 0.0, _MOST_FASTER
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if share(middle) > wanted else (low, middle)
        found.append((0.5 * (low + high), predicted(0.5 * (low + high))))
    return found


def walked(folder: Path, effect: str, seed: int) -> list[Step]:
    """Walk the robot's gaits over the cliff, from the campaign in `folder`."""
    model = load_model(folder / "model-last.toml")
    gait = Gait(**json.loads((folder / "rounds.json").read_text())[-1]["gait"])
    steps = []
    for number, (faster, prediction) in enumerate(at_the_cliff(model, gait)):
        quicker = replace(gait, period_s=gait.period_s * (1.0 - faster))
        with tempfile.TemporaryDirectory() as aside, loop.robot(effect, seed).open(_STAGE + number) as rig:
            dataset = measure_walks(rig, Path(aside) / "walks", {"g": quicker}, _CYCLES, RUNS)
        runs = tuple(speed_of(trial).mean_mm_s for trial in dataset.trials)
        least = max(MIN_SPEED_RATIO * prediction.speed_mm_s, STANDING_MM_S)
        which = tuple(speed >= least for speed in runs)
        steps.append(Step(faster, prediction.walks_probability, prediction.interval_90_mm_s, runs, which))
    return steps


HEADING = f"{'effect, seed':24}" + "".join(f"{f'{100 * wanted:.0f} %':>18}" for wanted in WANTED)


def row(name: str, steps: Sequence[Step]) -> str:
    """A line of the table under `HEADING`: by how many per cent the period is shorter, and how many runs walked."""
    cells = [f"-{100 * step.faster:.2f} %: {sum(step.walked)} of {len(step.walked)}" for step in steps]
    return f"{name:24}" + ("".join(f"{cell:>18}" for cell in cells) or "no cliff")


def summed_up(found: Sequence[Sequence[Step]]) -> dict[str, float]:
    """Print predicted and walked shares by `WANTED`, and the Brier score; return the figures."""
    with_cliff = [steps for steps in found if steps]
    if not with_cliff:
        return {}
    print(f"\n{f'robots: {len(with_cliff)}':24}" + "".join(f"{f'{100 * wanted:.0f} %':>9}" for wanted in WANTED))
    by_wanted = list(zip(*with_cliff, strict=True))
    print(f"{'predicted':24}" + "".join(f"{mean(step.probability for step in steps):9.2f}" for steps in by_wanted))
    shares = [mean(walks for step in steps for walks in step.walked) for steps in by_wanted]
    print(f"{'walked':24}" + "".join(f"{share:9.2f}" for share in shares))
    every = [(step.probability, walks) for steps in with_cliff for step in steps for walks in step.walked]
    brier = mean((probability - walks) ** 2 for probability, walks in every)
    inside = [low <= v <= high for steps in with_cliff for low, high, v in _walking(steps)]
    print(f"Brier score of {len(every)} runs: {brier:.3f}; of {len(inside)} that walked {mean(inside):.2f} in the 90 %")
    return {"cliff_robots": len(with_cliff), "cliff_brier": brier, "cliff_holds_90": mean(inside)}


def _walking(steps: Sequence[Step]) -> list[tuple[float, float, float]]:
    """Interval and speed of each run that walked."""
    return [
        (*step.interval_90_mm_s, speed)
        for step in steps
        for speed, walks in zip(step.runs_mm_s, step.walked, strict=True)
        if walks
    ]


def run(out: Path, kept: Path | None = None, only_print: bool = False) -> dict[str, float]:
    """Print the table, one line per robot; return the figures flat."""
    known = lines.read(kept, "robot")
    if not only_print:
        for rounds in sorted((out / version()).glob("*/rounds.json")):
            name = rounds.parent.name
            if name not in known:
                effect, _, seed = name.rpartition("-")
                known[name] = {"robot": name, "steps": [asdict(s) for s in walked(rounds.parent, effect, int(seed))]}
                if kept:
                    lines.write(kept, known.values())
    print(HEADING)
    found = {name: [_step_of(step) for step in record["steps"]] for name, record in known.items()}
    for name, steps in found.items():
        print(row(name, steps))
    return summed_up(list(found.values()))


def _step_of(record: dict[str, Any]) -> Step:
    return Step(**{name: tuple(v) if isinstance(v, list | tuple) else v for name, v in record.items()})


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.cliff", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=loop.OUT, help="where benchmarks.loop keeps its campaigns")
    parser.add_argument("--records", type=Path, help="one line of JSON per robot; read first, then kept up to date")
    parser.add_argument("--print", action="store_true", help="only print what is in the records")
    options = parser.parse_args()
    if options.print and not options.records:
        parser.error("--print needs the records to print: add --records FILE")
    run(options.out, options.records, options.print)


if __name__ == "__main__":
    main()
