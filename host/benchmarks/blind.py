"""Blind trial of the diagnosis: sealed data sets, verdicts first, labels opened afterwards.

    python -m benchmarks.blind --truth own|realistic|foreign --singles 60 --none 20 [--jobs 2] [--out FOLDER]
                          [--records FILE [--print]] [--table FOLDER]
    python -m benchmarks.blind systems [...]     other systems than robots: python -m benchmarks.small_systems

Each data set is drawn from its seed by `python -m virtual_robot.sealed`, or measured through the real firmware by
`python -m harness.sealed_campaign` (`realistic`). Single effects come in turn, sizes and pairs at random; effects
outside the library are those never in it and, except for the foreign truth, each library effect in turn, withheld from
the diagnosis. FOLDER keeps verdicts and progress logs, so that an interrupted trial resumes. FILE has one line per data
set, with which a trial resumes on another machine; `--print` only prints what is in it. Beside FILE, compressed, is
what each diagnosis tried, for testing decision rules with `python -m benchmarks.replay`. Prints the figures with 95 %
Wilson intervals, compared with four baselines that see the same fits: the best single refit by error, BIC, greedy
forward selection, and sparse regression on the base model's residual.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from benchmarks import records as lines
from benchmarks import small_systems
from benchmarks.blind_figures import BASELINES, CLOSE, brief, name_of, report, said_of, table
from benchmarks.cost import SimulationCount, processor_s
from benchmarks.search_record import searched, version, write_losses
from virtual_robot import effects as own
from virtual_robot.truths.foreign import effects as foreign

_STRIDE = 7  # through the effects: coprime to their number, so that related ones come far apart
_DRAWN_BY = {
    "own": ["-m", "virtual_robot.sealed"],
    "realistic": ["-m", "harness.sealed_campaign"],
    "foreign": ["-m", "virtual_robot.sealed", "--truth", "foreign"],
}


@dataclass(frozen=True)
class Job:
    """One data set to draw. `kind` is "single", "none", "outside" or "pair"; `effect` None: drawn by the seed;
    `withheld`: the effect is missing from the diagnosis's library."""

    truth: str
    kind: str
    seed: int
    effect: str | None = None
    withheld: bool = False


def jobs(truth: str, counts: dict[str, int], first_seed: int) -> list[Job]:
    """The jobs, kinds mixed in proportion, so that an interrupted trial has some of each."""
    effects = foreign if truth == "foreign" else own
    withheld = () if truth == "foreign" else own.LIBRARY
    outside = [*((name, False) for name in effects.OUTSIDE), *((name, True) for name in withheld)]
    placed = []
    for place, (kind, count) in enumerate(counts.items()):
        for k in range(count):
            seed = first_seed + 1000 * place + k
            job = Job(truth, kind, seed)
            if kind == "single":
                job = Job(truth, kind, seed, effects.LIBRARY[_STRIDE * k % len(effects.LIBRARY)])
            elif kind == "outside":
                job = Job(truth, kind, seed, *outside[_STRIDE * k % len(outside)])
            placed.append(((k + 0.5) / count, job))
    return [job for _, job in sorted(placed, key=lambda pair: pair[0])]


def diagnose_sealed(job: Job, out: Path, threads: int) -> dict:
    """Draw, diagnose on `threads` threads, and only then open the label. Return the record kept for the data set."""
    kept = out / f"{job.truth}-{job.kind}-{job.effect or 'drawn'}-{job.seed}.json"
    if kept.exists() and (record := json.loads(kept.read_text()))["version"] == version():
        return record
    with tempfile.TemporaryDirectory() as scratch:
        folder, verdict = Path(scratch) / "sealed", Path(scratch) / "verdict.json"
        kind = "one" if job.kind == "single" else job.kind
        options = ["--effect", job.effect] if job.effect else ["--kind", kind]
        withheld = ["--without", job.effect] if job.withheld else []
        label = Path(scratch) / "label" / "sealed.toml"
        label.parent.mkdir()
        sealed = [*_DRAWN_BY[job.truth], "--seed", str(job.seed), "--out", str(folder), *options]
        subprocess.run([sys.executable, *sealed, "--label", str(label)], check=True)
        one = [sys.executable, "-m", "benchmarks.blind", "--one", str(folder), "--json", str(verdict), *withheld]
        one += ["--threads", str(threads)]
        out.mkdir(parents=True, exist_ok=True)
        with kept.with_suffix(".log").open("w") as log:
            subprocess.run(one, check=True, stdout=log)
        record = json.loads(verdict.read_text())
        truth = tomllib.loads(label.read_text())
    record |= {"seed": job.seed, "kind": job.kind, "truth": sorted(truth["effects"]), "sizes": truth["sizes"]}
    record |= {"values": truth["effects"], "base_values": truth.get("parameters", {})}
    kept.write_text(json.dumps(record, indent=1))
    return record


def diagnose_one(folder: Path, verdict: Path, without: str | None, threads: int) -> None:
    """Diagnose one folder with a library that lacks `without`; write that and the baselines' answers to `verdict`."""
    from bifa.data import read_dataset
    from bifa.identify.start import prepare
    from lacuna.diagnosis.diagnose import diagnose
    from lacuna.diagnosis.record import as_record
    from lacuna.estimation.problem import use_threads

    use_threads(threads)
    system = prepare(read_dataset(folder))
    system.effects = {name: effect for name, effect in system.effects.items() if name != without}
    simulations = SimulationCount()
    simulations.of_trials(system)
    began = time.monotonic()
    found = diagnose(system, on_progress=lambda what: print(f"{time.monotonic() - began:6.0f} s  {what}", flush=True))
    spent_s, tried = processor_s(), searched(found, simulations.count)
    record = as_record(found) | {"processor_seconds": spent_s, "baselines": baselines(found.search), "search": tried}
    record |= {name: tried[name] for name in ("version", "simulations")}
    verdict.write_text(json.dumps(record), encoding="utf-8")


def baselines(search) -> dict[str, list[str]]:
    """The effects that simpler rules name; rules without a verdict "none" always name something."""
    singles = [c for c in search.tried if len(c.effects) == 1]
    by_error = min(singles or [search.base], key=lambda c: c.fitted.cost + c.checked.cost)
    by_bic = min(search.tried, key=_bic)
    greedy = search.base
    while True:
        larger = [c for c in search.tried if set(greedy.effects) < set(c.effects)]
        larger = [c for c in larger if len(c.effects) == len(greedy.effects) + 1]
        best = min(larger, key=_bic, default=None)
        if best is None or _bic(best) >= _bic(greedy):
            break
        greedy = best
    sparse = max(search.screened, key=lambda s: s.gain)
    named = (by_error.effects, by_bic.effects, greedy.effects, (sparse.effect,))
    return {name: list(effects) for name, effects in zip(BASELINES, named, strict=True)}


def _bic(candidate) -> float:
    library = candidate.fitted.structure.system.effects
    extra = sum(len(library[name].parameters) for name in candidate.effects)
    return 2 * (candidate.fitted.cost + candidate.checked.cost) + extra * math.log(candidate.pieces)


def main() -> None:
    if sys.argv[1:2] == ["systems"]:
        raise SystemExit(small_systems.main(sys.argv[2:]))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    counts = {"singles": ("single", 60), "none": ("none", 20), "outside": ("outside", 22), "pairs": ("pair", 20)}
    for name, (_, count) in counts.items():
        parser.add_argument(f"--{name}", type=int, default=count)
    parser.add_argument("--truth", choices=tuple(CLOSE), default="own", help="whose equations the robots follow")
    parser.add_argument("--first-seed", type=int, default=1000)
    cores = len(os.sched_getaffinity(0))
    parser.add_argument("--jobs", type=int, default=cores, help="number run at once, sharing the cores")
    parser.add_argument("--out", type=Path, default=Path("../out/blind"))
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--json", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--without", help=argparse.SUPPRESS)
    parser.add_argument("--threads", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--records", type=Path, help="one line of JSON per data set; read first, then kept up to date")
    parser.add_argument("--print", action="store_true", help="only print what is in the records")
    parser.add_argument("--table", type=Path, metavar="FOLDER", help="print the rates of all truths recorded there")
    options = parser.parse_args()
    if options.table:
        found = {truth: lines.read(options.table / f"{truth}.jsonl", "kind", "seed") for truth in CLOSE}
        print(table({truth: list(records.values()) for truth, records in found.items()}))
        return
    if options.one:
        diagnose_one(options.one, options.json, options.without, options.threads)
        return
    if options.print and not options.records:
        parser.error("--print needs the records to print: add --records FILE")
    known = lines.read(options.records, "kind", "seed")
    if options.print:
        report(list(known.values()), options.truth)
        return
    todo = jobs(options.truth, {kind: getattr(options, n) for n, (kind, _) in counts.items()}, options.first_seed)
    records = []
    with ThreadPoolExecutor(options.jobs) as pool:
        try:
            threads = max(1, cores // options.jobs)
            for record in pool.map(
                lambda job: known.get((job.kind, job.seed)) or diagnose_sealed(job, options.out, threads), todo
            ):
                records.append(record)
                if options.records:
                    write_losses(options.records, record)
                    known[record["kind"], record["seed"]] = record
                    lines.write(options.records, map(brief, known.values()))  # last: an interrupted one is repeated
                sizes = ", ".join(f"{size:.2f}" for size in record["sizes"].values())
                print(
                    f"{record['kind']:8}{record['seed']}  {name_of(record['truth'])} ({sizes}) -> {said_of(record)}"
                    f"  {record['processor_seconds']:.0f} s of processor",
                    flush=True,
                )
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            print(f"interrupted: figures of {len(records)} of {len(todo)} data sets\n")
    report(records, options.truth)


if __name__ == "__main__":
    main()
