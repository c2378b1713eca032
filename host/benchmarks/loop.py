"""What a completed model gains: walks at the edge of what is known, by the base and the completed model.

    python -m benchmarks.loop [--effects hysteresis,leak] [--seeds 3] [--first-seed 200] [--out ../out/loop]
                              [--records FILE] [--print] [--plot PNG]

For each effect of the library at its modest size and each seed, runs a whole campaign through the real firmware,
profile `realistic`, as `bifa campaign` does, with another specimen of the robot and other noise. Five gaits are walked:
the paper's baseline; with the base model, at the edge of its fit's covariance alone (naive, what people do) and at the
edge of all that is known of it (fair: its remainder is large, and so is its margin); with the completed model, robust
against 2 % (what campaigns used to do) and at the edge, the gait that the campaign hands over. For each, the model that
it was sought with predicts an interval and the probability of walking. Campaigns stay in OUT, by version, so that an
interrupted run resumes; FILE has one line for each, with which it resumes on another machine. A run "walks" if it
advances by at least four fifths of the prediction, and by 1 mm/s.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from statistics import mean, median
from typing import Any

import numpy as np

from benchmarks import records as lines
from benchmarks.search_record import version
from bifa.campaign.again import fastest_at_edge, read_rounds
from bifa.campaign.loop import campaign, found_gait
from bifa.campaign.setup import Effort, Setup
from bifa.campaign.stages import Stage, run_stages
from bifa.campaign.walks import measure_walks, planned_cycles, prediction_of, speed_of, walks_of
from bifa.data import read_dataset
from bifa.gait import SearchError
from bifa.gait.prediction import MIN_SPEED_RATIO
from bifa.gait.settling import STANDING_MM_S, complete_cycles
from bifa.robot import load_model
from bifa.robot.gait import BASELINE, save_gait
from virtual_robot.effects import EFFECTS, LIBRARY

SEEDS, FIRST_SEED, OUT = 3, 200, Path("../out/loop")
GAITS = ("baseline", "naive", "fair", "robust", "edge")
_TITLES = ("baseline", "base, naive", "base, fair", "completed, 2 %", "completed, edge")
_STAGE = 60  # the first of the rig's numbers for the walks of this table
_LEVELS = (0.8, 0.9, 0.95)


@dataclass(frozen=True)
class Walked:
    """One gait: predicted speed, its intervals by level, the probability of walking, and the speeds of its runs."""

    predicted_mm_s: float
    intervals_mm_s: dict[str, tuple[float, float]]
    walks_probability: float
    runs_mm_s: tuple[float, ...]

    @property
    def walks(self) -> tuple[bool, ...]:
        """Which runs walk."""
        least = max(MIN_SPEED_RATIO * self.predicted_mm_s, STANDING_MM_S)
        return tuple(speed >= least for speed in self.runs_mm_s)

    def holds(self, level: float) -> list[bool]:
        """For each run that walks, whether its speed lies in the interval."""
        low, high = self.intervals_mm_s[str(level)]
        return [low <= v <= high for v, walks in zip(self.runs_mm_s, self.walks, strict=True) if walks]


@dataclass(frozen=True)
class Gain:
    """One robot: the effects named, its gaits by name, and for each gait that was walked at the completed model's edge,
    whether its mean speed lay in the interval of 90 %."""

    effect: str
    seed: int
    named: tuple[str, ...]
    gaits: dict[str, Walked]
    edge_inside: tuple[bool, ...] = ()
    version: str = ""


def measured(effect: str, seed: int, out: Path, effort: Effort | None = None) -> Gain:
    """Run or resume the campaign on the robot with `effect` at its modest size, and walk its gaits."""
    # By version, whose finished stages another would take for its own.
    setup, folder = robot(effect, seed), out / version() / f"{effect}-{seed}"
    stages = campaign(setup, effort or Effort(), lambda what, share: None)
    run_stages(folder, stages, on_start=_begun)
    summary = json.loads((folder / "summary.json").read_text())
    rounds = read_rounds(folder / "rounds.json")
    gaits = walked(folder, rounds, setup, effort or Effort())
    inside = tuple(one["inside"] for one in rounds if one["at_edge"])
    print("\r" + " " * 60, end="\r")
    return Gain(effect, seed, tuple(found["name"] for found in summary["effects"]), gaits, inside, version())


def robot(effect: str, seed: int) -> Setup:
    """The setup of a specimen with `effect` at its modest size."""
    values = EFFECTS[effect].at(1.0, np.random.default_rng([seed, 0x100]))
    return Setup(
        "virtual",
        seed,
        {"sealed": seed, "sealed_kind": "none", "effects": {effect: values}, "profile": "realistic"},
    )


def _begun(stage: Stage) -> None:
    print(f"\r{stage.title:60}", end="", flush=True)


def walked(folder: Path, rounds: Sequence[Mapping[str, Any]], setup: Setup, effort: Effort) -> dict[str, Walked]:
    """The gaits of a finished campaign in `folder`; the base model's gaits at its edge are found and walked here."""
    found = {"baseline": "walks-base", "robust": "walks-completed"}
    models = dict.fromkeys(found, "model-completed.toml")
    if number := fastest_at_edge(rounds):
        found["edge"], models["edge"] = f"rounds/walks-{number}", f"rounds/model-{number}.toml"
    # As long as the campaign's longest walk: with a tether that lengthens, short walks look too fast.
    least = max(_cycles(folder / place) for place in found.values())
    for number, (name, naive) in enumerate({"naive": True, "fair": False}.items()):
        _walk_base(folder, name, naive, setup, replace(effort, cycles=least), _STAGE + number)
        found[name], models[name] = f"walks-{name}", "model-base.toml"
    return {name: _walked(folder / found[name], folder / models[name], name) for name in GAITS if name in found}


def _walk_base(folder: Path, name: str, naive: bool, setup: Setup, effort: Effort, stage: int) -> None:
    if (folder / f"walks-{name}").exists():
        return
    model = load_model(folder / "model-base.toml")
    try:
        gait = found_gait(model, setup.seed, None, lambda *_: None, naive=naive).gait
    except SearchError:
        gait = BASELINE
    save_gait(folder / f"gait-{name}.toml", gait, {"made_by": "benchmarks.loop"})
    cycles = planned_cycles(model, gait, effort.cycles)
    with setup.open(stage) as rig:
        measure_walks(rig, folder / f"walks-{name}", {name: gait}, cycles, effort.repeats)


def _cycles(walks: Path) -> int:
    return max(complete_cycles(trial.time_s, trial.walked["period_s"]) for trial in read_dataset(walks).trials)


def _walked(walks: Path, model: Path, name: str) -> Walked:
    dataset = read_dataset(walks)
    trials = walks_of(BASELINE, dataset) if name == "baseline" else dataset.trials
    prediction = prediction_of(load_model(model), trials[0], naive=name == "naive")
    return Walked(
        prediction.speed_mm_s,
        {str(level): prediction.interval_mm_s(level) for level in _LEVELS},
        prediction.walks_probability,
        tuple(speed_of(trial).mean_mm_s for trial in trials),
    )


HEADING = f"{'effect, seed':24}{'named':12}" + "".join(f"{title:>26}" for title in _TITLES)


def row(one: Gain) -> str:
    """A line of the table under `HEADING`: for each gait, interval predicted and speed walked; * if runs fell."""
    alone = "yes" if one.named == (one.effect,) else "and others" if one.effect in one.named else "no"
    cells = [_cell(one.gaits[name]) if name in one.gaits else "none" for name in GAITS]
    return f"{f'{one.effect}, {one.seed}':24}{alone:12}" + "".join(f"{cell:>26}" for cell in cells)


def _cell(gait: Walked) -> str:
    low, high = gait.intervals_mm_s["0.9"]
    fell = "" if all(gait.walks) else "*"
    return f"{low:.2f}..{high:.2f} {mean(gait.runs_mm_s):.2f}{fell}"


def summed_up(gains: Sequence[Gain]) -> dict[str, float]:
    """Print means over all robots, coverage of the intervals and calibration of the probabilities; return them."""
    figures: dict[str, float] = {"loop_robots": len(gains)}
    if versions := sorted({one.version for one in gains} - {""}):
        print(f"\nengine {', '.join(versions)}", end="")
    print(f"\n{f'robots: {len(gains)}':20}{'mm/s':>8}{'walk':>8}{'80 %':>8}{'90 %':>8}{'95 %':>8}{'Brier':>8}")
    for name, title in zip(GAITS, _TITLES, strict=True):
        ones = [one.gaits[name] for one in gains if name in one.gaits]
        if not ones:
            continue
        own = {
            "mm_s": mean(mean(one.runs_mm_s) for one in ones),
            "walks": mean(walks for one in ones for walks in one.walks),
            **{f"holds_{100 * level:.0f}": _share([h for one in ones for h in one.holds(level)]) for level in _LEVELS},
            "brier": mean((one.walks_probability - walks) ** 2 for one in ones for walks in one.walks),
        }
        print(f"{title:20}" + "".join(f"{value:8.2f}" for value in own.values()))
        figures |= {f"loop_{name}_{key}": value for key, value in own.items()}
    return figures | _first_rounds(gains) | _against(gains)


def _first_rounds(gains: Sequence[Gain]) -> dict[str, float]:
    """Coverage over first gaits at the edge: a further round follows a miss, so the gaits handed over flatter it."""
    rounds = [one.edge_inside for one in gains if one.edge_inside]
    if not rounds:
        return {}
    first, every = [inside[0] for inside in rounds], [held for inside in rounds for held in inside]
    print(
        f"in their interval of 90 %: {sum(first)} of {len(first)} first gaits at the edge, {sum(every)} of "
        f"{len(every)} that were walked there"
    )
    return {"loop_first_edge_holds_90": mean(first), "loop_every_edge_holds_90": mean(every)}


def _share(held: Sequence[bool]) -> float:
    return mean(held) if held else float("nan")


def _against(gains: Sequence[Gain]) -> dict[str, float]:
    """Compare the completed model's edge with the robust gait and with the better of the base model's gaits."""
    pairs = [one.gaits for one in gains if "edge" in one.gaits]
    if not pairs:
        return {}
    speed = [{name: mean(gait.runs_mm_s) for name, gait in gaits.items()} for gaits in pairs]
    gain = mean(one["edge"] for one in speed) / mean(one["robust"] for one in speed) - 1.0
    ahead = min(one["edge"] / max(one["naive"], one["fair"], 1e-9) - 1.0 for one in speed)
    errors = [mean(gaits["edge"].runs_mm_s) / gaits["edge"].predicted_mm_s - 1.0 for gaits in pairs]
    print(f"speed walked at the edge against the predicted one: {100 * median(errors):+.2f} % (median)")
    print(f"edge against the robust gait: {100 * gain:+.1f} % on average")
    print(f"edge against the better of the base model's gaits: {100 * ahead:+.1f} % at worst")
    return {"loop_edge_median_error": median(errors), "loop_edge_gain": gain, "loop_edge_worst_ahead_of_base": ahead}


def reliability(gains: Sequence[Gain], bins: Sequence[float] = (0.0, 0.5, 0.8, 0.9, 0.95, 1.0)) -> list[tuple]:
    """Reliability of the probability of walking: (mean predicted, share that walked, runs) of each bin."""
    pairs = np.array([(g.walks_probability, w) for one in gains for g in one.gaits.values() for w in g.walks], float)
    found = []
    for low, high in pairwise(bins):
        inside = pairs[(pairs[:, 0] > low) & (pairs[:, 0] <= high)]
        if len(inside):
            found.append((float(inside[:, 0].mean()), float(inside[:, 1].mean()), len(inside)))
    return found


def plot(gains: Sequence[Gain], file: Path) -> None:
    """Write the reliability plot to `file`."""
    from matplotlib.figure import Figure

    figure = Figure((4.0, 4.0), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color="0.7")
    for predicted_share, share, runs in reliability(gains):
        axes.plot(predicted_share, share, "o", color="C0")
        axes.annotate(f"{runs}", (predicted_share, share), xytext=(4, -10), textcoords="offset points")
    axes.set(
        xlabel="probability of walking, predicted", ylabel="share of runs that walk", xlim=(0, 1.03), ylim=(0, 1.03)
    )
    figure.savefig(file, dpi=120)


def run(effects: Sequence[str], seeds: Sequence[int], out: Path, kept: Path | None = None) -> dict[str, float]:
    """Print the table, a line as each campaign ends; return the figures flat. Ctrl-C ends with a summary of those done.
    `kept`: the file of records."""
    known = lines.read(kept, "effect", "seed")
    print(HEADING)
    gains = []
    try:
        for seed in seeds:
            for effect in effects:
                record = known.get((effect, seed))
                gains.append(_gain_of(record) if record else measured(effect, seed, out))
                print(row(gains[-1]), flush=True)
                if kept and not record:
                    known[effect, seed] = asdict(gains[-1])
                    lines.write(kept, known.values())
    except KeyboardInterrupt:
        print(f"\ninterrupted after {len(gains)} of {len(effects) * len(seeds)} robots; the same command resumes")
    return summed_up(gains) if gains else {}


def _gain_of(record: dict[str, Any]) -> Gain:
    gaits = {name: Walked(**one | {"runs_mm_s": tuple(one["runs_mm_s"])}) for name, one in record["gaits"].items()}
    inside = tuple(record.get("edge_inside", ()))  # older records lack it
    return Gain(record["effect"], record["seed"], tuple(record["named"]), gaits, inside, record.get("version", ""))


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.loop", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--effects", default=",".join(LIBRARY), help="comma-separated names; default: whole library")
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--records", type=Path, help="one line of JSON per campaign; read first, then kept up to date")
    parser.add_argument("--print", action="store_true", help="only print what is in the records")
    parser.add_argument("--plot", type=Path, metavar="PNG", help="draw the reliability of the records' probabilities")
    options = parser.parse_args()
    effects = options.effects.split(",")
    if unknown := set(effects) - set(LIBRARY):
        parser.error(f"no effect {', '.join(sorted(unknown))}; there are {', '.join(LIBRARY)}")
    if (options.print or options.plot) and not options.records:
        parser.error("--print and --plot need records: add --records FILE")
    if not options.print:
        seeds = range(options.first_seed, options.first_seed + options.seeds)
        run(effects, seeds, options.out, options.records)
    if options.print or options.plot:
        gains = [_gain_of(record) for record in lines.read(options.records, "effect", "seed").values()]
        if options.print:
            print("\n".join([HEADING, *map(row, gains)]))
            summed_up(gains)
        if options.plot:
            plot(gains, options.plot)


if __name__ == "__main__":
    main()
