"""Whether the README's example is reproducible: `bifa demo` with several seeds, and the outcomes.

    python -m benchmarks.demos [--seeds 10] [--first-seed 1000] [--jobs 2] [--out ../out/demos] [--records FILE]
                               [--print]

Each is a whole campaign through the real firmware on a robot with one undisclosed effect. Campaigns stay in OUT, so
that an interrupted run resumes; FILE has one line for each, with which it resumes on another machine.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import mean
from typing import NamedTuple

from benchmarks import records as lines
from benchmarks.blind_figures import wilson
from benchmarks.search_record import version
from bifa.campaign.again import fastest_at_edge

SEEDS, FIRST_SEED, JOBS, OUT = 10, 1000, 2, Path("../out/demos")


class Story(NamedTuple):
    """A demo: the sealed and the named effects; errors on held-out trials, in units of the noise; the speed walked with
    a margin of 2 %; and for the gait handed over, at the edge of what is known, the speeds predicted and walked."""

    seed: int
    truth: tuple[str, ...]
    verdict: str
    named: tuple[str, ...]
    before: float
    after: float
    floor: float
    robust_mm_s: float
    predicted_mm_s: float
    measured_mm_s: float

    @property
    def right(self) -> bool:
        """Whether the sealed effect was named first."""
        return self.named[:1] == self.truth[:1]


def told(seed: int, out: Path) -> Story:
    """Run the demo, or resume it."""
    folder = out / version() / str(seed)  # another version would take its finished stages for its own
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "bifa", "demo", "--seed", str(seed), "--out", str(folder / "demo")]
    with (folder / "printed.txt").open("w") as printed:
        subprocess.run(command, check=True, stdout=printed, stderr=subprocess.STDOUT)
    return story(seed, json.loads((folder / "demo" / "summary.json").read_text()))


def story(seed: int, summary: dict) -> Story:
    """Extract a story from a demo's `summary.json`."""
    rounds = summary["rounds"]
    robust, edge = rounds[0], rounds[(fastest_at_edge(rounds) or 1) - 1]
    error = {name: summary["error"][name]["held_out"] for name in ("before", "after", "noise_floor")}
    return Story(
        seed,
        tuple(summary["truth"]),
        summary["verdict"],
        tuple(effect["name"] for effect in summary["effects"]),
        *error.values(),
        robust["measured_mm_s"],
        edge["predicted_mm_s"],
        edge["measured_mm_s"],
    )


HEADING = f"{'seed':6}{'sealed':22}{'named':34}{'before':>8}{'after':>7}{'floor':>7}{'2 %':>8}{'edge':>8}{'walked':>8}"


def row(one: Story) -> str:
    """A line of the table under `HEADING`."""
    sealed, named = " + ".join(one.truth), " + ".join(one.named) or one.verdict
    errors = f"{one.before:8.2f}{one.after:7.2f}{one.floor:7.2f}"
    speeds = "".join(f"{speed:8.2f}" for speed in (one.robust_mm_s, one.predicted_mm_s, one.measured_mm_s))
    return f"{one.seed:<6}{sealed:22}{named:34}{errors}{speeds}"


def summed_up(stories: Sequence[Story]) -> dict[str, float]:
    """Print how many were right; return the figures."""
    right = sum(one.right for one in stories)
    low, high = wilson(right, len(stories))
    gain = mean(one.measured_mm_s / one.robust_mm_s for one in stories) - 1.0
    print(f"named first what the seal held: {right} of {len(stories)} [{low:.2f}, {high:.2f}]")
    print(f"the edge against the margin of 2 %: {100 * gain:+.1f} % on average")
    return {"demos": len(stories), "demos_right": right, "demos_edge_gain": gain}


def run(seeds: Sequence[int], out: Path, jobs: int, kept: Path | None = None) -> dict[str, float]:
    """Print the table, a line as each demo ends; return the figures flat."""
    known = lines.read(kept, "seed")
    print(HEADING)
    stories = []
    with ThreadPoolExecutor(jobs) as pool:
        for one in pool.map(lambda seed: _story_of(known[seed]) if seed in known else told(seed, out), seeds):
            stories.append(one)
            print(row(one), flush=True)
            if kept:
                known[one.seed] = one._asdict()
                lines.write(kept, known.values())
    return summed_up(stories)


def _story_of(record: dict) -> Story:
    return Story(**record | {name: tuple(record[name]) for name in ("truth", "named")})


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.demos", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED)
    parser.add_argument("--jobs", type=int, default=JOBS, help="number run at once, sharing the cores")
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--records", type=Path, help="one line of JSON per demo; read first, then kept up to date")
    parser.add_argument("--print", action="store_true", help="only print what is in the records")
    options = parser.parse_args()
    if options.print and not options.records:
        parser.error("--print needs the records to print: add --records FILE")
    if options.print:
        run(sorted(lines.read(options.records, "seed")), options.out, 1, options.records)
    else:
        seeds = range(options.first_seed, options.first_seed + options.seeds)
        run(seeds, options.out, options.jobs, options.records)


if __name__ == "__main__":
    main()
