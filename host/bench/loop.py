"""What a completed model buys: the gait found with it beside the gait found with the base model, both walked.

    python -m bench.loop [--effects hysteresis,leak] [--seeds 3] [--first-seed 200] [--out ../out/loop] [--records FILE]

For each effect of the library at its full size and each seed, a whole campaign through the real firmware, profile
`realistic`, as `bifa campaign` runs it: another specimen of the robot, other noise. Campaigns stay in OUT, so that an
interrupted run goes on where it was; FILE has a line for each, with which it goes on on another machine. A gait "walks"
on a robot if it advances by more than 1 mm/s.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from statistics import mean
from typing import NamedTuple

import numpy as np

from bench import records as lines
from bifa.campaign.bench import Bench
from bifa.campaign.loop import Effort, campaign
from bifa.campaign.stages import Stage, run_stages
from virtual_robot.effects import EFFECTS, LIBRARY

SEEDS, FIRST_SEED, OUT = 3, 200, Path("../out/loop")
_WALKS_MM_S = 1.0


class Gain(NamedTuple):
    """One robot: of the gaits found with the base and with the completed model, in this order, the speed that the model
    in question predicted, the speed measured, and the share of nearly equal robots that walk with it."""

    effect: str
    seed: int
    named: tuple[str, ...]
    predicted_mm_s: tuple[float, float]
    measured_mm_s: tuple[float, float]
    walking: tuple[float, float]

    @property
    def off_mm_s(self) -> tuple[float, float]:
        """By how much each prediction was off."""
        base, completed = (abs(p - m) for p, m in zip(self.predicted_mm_s, self.measured_mm_s, strict=True))
        return base, completed


def measured(effect: str, seed: int, out: Path, effort: Effort | None = None) -> Gain:
    """Run the campaign on the robot with `effect` at its full size, or what is left of it to run."""
    values = EFFECTS[effect].at(1.0, np.random.default_rng([seed, 0x100]))
    options = {"sealed": seed, "sealed_kind": "none", "effects": {effect: values}, "profile": "realistic"}
    stages = campaign(Bench("virtual", seed, options), effort or Effort(), lambda what, share: None)
    folder = out / f"{effect}-{seed}"
    run_stages(folder, stages, on_start=_begun)
    print("\r" + " " * 60, end="\r")
    return gain(effect, seed, json.loads((folder / "summary.json").read_text()))


def _begun(stage: Stage) -> None:
    print(f"\r{stage.title:60}", end="", flush=True)


def gain(effect: str, seed: int, summary: dict) -> Gain:
    """From a campaign's `summary.json`."""
    gaits = {found["gait"]: found for found in summary["gaits"]}
    base, completed = gaits["base"], gaits["completed"]
    return Gain(
        effect,
        seed,
        tuple(found["name"] for found in summary["effects"]),
        (base["base_model"], completed["completed_model"]),
        (base["measured"], completed["measured"]),
        tuple(mean(speed > _WALKS_MM_S for speed in summary["robustness"][name]) for name in ("base", "completed")),
    )


HEADING = (
    f"{'':38}{'gait from the base model':>32}   {'gait from the completed model':>32}\n"
    f"{'effect, seed':25}{'named':13}" + "   ".join([f"{'predicted':>11}{'measured':>11}{'walking':>10}"] * 2)
)


def row(one: Gain) -> str:
    """A line of the table under `HEADING`: mm/s, and the share of nearly equal robots that walk."""
    alone = "yes" if one.named == (one.effect,) else "and others" if one.effect in one.named else "no"
    each = zip(one.predicted_mm_s, one.measured_mm_s, one.walking, strict=True)
    columns = "   ".join(f"{p:11.2f}{m:11.2f}{walking:10.2f}" for p, m, walking in each)
    return f"{f'{one.effect}, {one.seed}':25}{alone:13}{columns}"


def summed_up(gains: Sequence[Gain]) -> dict[str, float]:
    """The means over all robots, and how often the completed model's gait is the faster one; printed and returned."""
    figures = {}
    for k, name in enumerate(("base", "completed")):
        figures[f"loop_{name}_mm_s"] = mean(one.measured_mm_s[k] for one in gains)
        figures[f"loop_{name}_prediction_off_mm_s"] = mean(one.off_mm_s[k] for one in gains)
        figures[f"loop_{name}_walking"] = mean(one.walking[k] for one in gains)
    figures["loop_completed_is_faster"] = mean(one.measured_mm_s[1] > one.measured_mm_s[0] for one in gains)
    title = f"means, robots: {len(gains)}"
    print(f"\n{title:33}{'base':>10}{'completed':>12}")
    for key, text in (("mm_s", "speed, mm/s"), ("prediction_off_mm_s", "prediction off by"), ("walking", "walking")):
        print(f"  {text:31}" + "".join(f"{figures[f'loop_{name}_{key}']:10.2f}  " for name in ("base", "completed")))
    print(f"  {'the faster one, share':31}{'':12}{figures['loop_completed_is_faster']:10.2f}")
    return figures


def run(effects: Sequence[str], seeds: Sequence[int], out: Path, kept: Path | None = None) -> dict[str, float]:
    """Print the table, a line as each campaign ends; returns the figures flat. Ctrl-C sums up what there is. `kept`:
    the file of records."""
    known = lines.read(kept, _place) if kept else {}
    print(HEADING)
    gains = []
    try:
        for seed in seeds:
            for effect in effects:
                record = known.get((effect, seed))
                gains.append(_gain_of(record) if record else measured(effect, seed, out))
                print(row(gains[-1]), flush=True)
                if kept and not record:
                    known[effect, seed] = gains[-1]._asdict()
                    lines.write(kept, known.values())
    except KeyboardInterrupt:
        print(f"\ninterrupted after {len(gains)} of {len(effects) * len(seeds)} robots; the same command goes on")
    return summed_up(gains) if gains else {}


def _place(record: dict) -> tuple[str, int]:
    return record["effect"], record["seed"]


def _gain_of(record: dict) -> Gain:
    return Gain(**{name: tuple(value) if isinstance(value, list) else value for name, value in record.items()})


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m bench.loop", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--effects", default=",".join(LIBRARY), help="names, with commas; default: all of the library")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--records", type=Path, help="a line of JSON a campaign; read first, and kept up to date")
    options = parser.parse_args()
    effects = options.effects.split(",")
    if unknown := set(effects) - set(LIBRARY):
        parser.error(f"no effect {', '.join(sorted(unknown))}; there are {', '.join(LIBRARY)}")
    run(effects, range(options.first_seed, options.first_seed + options.seeds), options.out, options.records)


if __name__ == "__main__":
    main()
