"""Blind trial of the diagnosis: sealed data sets, verdicts first, labels opened afterwards.

    python -m bench.blind --truth own|realistic|foreign --singles 60 --none 20 [--jobs 2] [--out FOLDER]
                          [--records FILE [--print]]

Each data set is drawn from its seed by `python -m virtual_robot.sealed`, or measured through the real firmware by
`python -m bench.sealed_campaign` (`realistic`): single effects in turn, sizes and pairs at random, outside the library
those that were never in it and, but for the foreign truth, each library effect in turn, withheld from the diagnosis.
Verdicts, and what each diagnosis did when, are kept in FOLDER, so that an interrupted trial continues; FILE has a line
for each data set, with which it continues on another machine, and `--print` only prints what is in it. Prints the
figures with 95 % Wilson intervals beside four baselines that see the same fits: the best single refit by error, BIC,
greedy forward selection, and sparse regression on the base model's residual.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from bench import blind_records
from virtual_robot import effects as own
from virtual_robot.truths.foreign import effects as foreign

_STRIDE = 7  # through the effects: coprime to their numbers, so that relatives in the list are far apart
_CLOSE = {"own": 1.2, "realistic": 1.2, "foreign": 1.3}  # floors that the error after may be
_DRAWN_BY = {
    "own": ["-m", "virtual_robot.sealed"],
    "realistic": ["-m", "bench.sealed_campaign"],
    "foreign": ["-m", "virtual_robot.sealed", "--truth", "foreign"],
}
BASELINES = ("best single", "BIC", "greedy", "sparse regression")


@dataclass(frozen=True)
class Job:
    """One data set to draw. `kind` is "single", "none", "outside" or "pair"; `effect` None: drawn by the seed;
    `withheld`: the diagnosis is not told of that effect."""

    truth: str
    kind: str
    seed: int
    effect: str | None = None
    withheld: bool = False


def jobs(truth: str, counts: dict[str, int], first_seed: int) -> list[Job]:
    """Kinds mixed in proportion, so that a trial that was interrupted has some of each."""
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
    """Draw, diagnose on so many threads, and only then open the label. Returns the record kept for one data set."""
    kept = out / f"{job.truth}-{job.kind}-{job.seed}.json"
    if kept.exists():
        return json.loads(kept.read_text())
    with tempfile.TemporaryDirectory() as scratch:
        folder, verdict = Path(scratch) / "sealed", Path(scratch) / "verdict.json"
        kind = "one" if job.kind == "single" else job.kind
        options = ["--effect", job.effect] if job.effect else ["--kind", kind]
        withheld = ["--without", job.effect] if job.withheld else []
        label = Path(scratch) / "label" / "sealed.toml"
        label.parent.mkdir()
        sealed = [*_DRAWN_BY[job.truth], "--seed", str(job.seed), "--out", str(folder), *options]
        subprocess.run([sys.executable, *sealed, "--label", str(label)], check=True)
        one = [sys.executable, "-m", "bench.blind", "--one", str(folder), "--json", str(verdict), *withheld]
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
    """The diagnosis of one folder with a library that lacks `without`, and what the baselines say of the same fits."""
    from bifa.data import read_dataset
    from bifa.identify.start import prepare
    from lacuna.diagnosis.diagnose import diagnose
    from lacuna.diagnosis.record import as_record
    from lacuna.estimation.problem import use_threads

    use_threads(threads)
    system = prepare(read_dataset(folder))
    system.effects = {name: effect for name, effect in system.effects.items() if name != without}
    began = time.monotonic()
    found = diagnose(system, progress=lambda what: print(f"{time.monotonic() - began:6.0f} s  {what}", flush=True))
    spent = os.times()
    processor = spent.user + spent.system + spent.children_user + spent.children_system
    record = as_record(found) | {"processor_seconds": processor, "baselines": baselines(found.search)}
    verdict.write_text(json.dumps(record))


def baselines(search) -> dict[str, list[str]]:
    """What simpler rules name: always something, for those that know no "none"."""
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


def wilson(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share."""
    if of == 0:
        return 0.0, 1.0
    z, share = 1.96, hits / of
    centre = (share + z * z / (2 * of)) / (1 + z * z / of)
    half = z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of)) / (1 + z * z / of)
    return max(centre - half, 0.0), min(centre + half, 1.0)


def report(records: list[dict], truth: str) -> None:
    """Print the figures of all data sets diagnosed."""
    close = _CLOSE[truth]
    by_kind = {kind: [r for r in records if r["kind"] == kind] for kind in ("single", "none", "outside", "pair")}
    single, none, outside, pair = by_kind.values()
    _share("one effect: named first", [_first(r) in r["truth"] for r in single])
    _share("one effect: in the reported set", [bool(set(r["truth"]) & _reported(r)) for r in single])
    sizes = [len(_reported(r)) for r in single if r["effects"]]
    print(f"  mean size of the reported set {sum(sizes) / max(len(sizes), 1):.2f}")
    _share("no effect: verdict none", [r["verdict"] == "none" for r in none])
    _share("outside the library: never plainly explained", [not _plain(r) for r in outside])
    _share("outside the library: unexplained", [r["verdict"] == "unexplained" for r in outside])
    _share("outside: at least half the gap closed", [_closed(r) >= 0.5 for r in outside])
    _share("two effects: both named", [set(r["truth"]) <= {e["name"] for e in r["effects"]} for r in pair])
    named = [r for r in single + pair if r["verdict"] == "identified"]
    _share(f"identified: error not fitted within {close} floors", [_ratio(r) <= close for r in named])
    of_conditions = [r for r in named if r["error"]["noise_floor"]["held_out_conditions"]]
    _share(
        f"identified: conditions not fitted within {close} floors",
        [_ratio(r, "held_out_conditions") <= close for r in of_conditions],
    )
    if truth != "foreign":
        _share("90 % intervals of sizes hold the truth", [hit for r in named for hit in _covered(r)])
        right = [r for r in single + none + pair if {e["name"] for e in r["effects"]} == set(r["truth"])]
        _share("90 % intervals of base parameters hold the truth", [hit for r in right for hit in _base_covered(r)])
    closed = sorted(_closed(r) for r in named)
    if closed:
        print(f"  median share of the gap closed {closed[len(closed) // 2]:.2f}")
    for name in BASELINES:
        _share(f"baseline {name}: one effect, named alone", [r["baselines"][name] == r["truth"] for r in single])
        _share(f"baseline {name}: no effect, says none", [not r["baselines"][name] for r in none])
    for kind, members in by_kind.items():
        if spent := sorted(r["processor_seconds"] for r in members):
            print(f"processor seconds, {kind:8} median {spent[len(spent) // 2]:.0f}, longest {spent[-1]:.0f}")
    print("\ntruth -> named")
    for (truth, said), count in sorted(Counter((_name(r["truth"]), _said(r)) for r in records).items()):
        print(f"  {count:3d}  {truth:40} {said}")


def _share(what: str, hits: list[bool]) -> None:
    if hits:
        low, high = wilson(sum(hits), len(hits))
        print(f"{what:55} {sum(hits):3d}/{len(hits):<3d} = {sum(hits) / len(hits):.2f}  [{low:.2f}, {high:.2f}]")


def _first(record: dict) -> str | None:
    return record["effects"][0]["name"] if record["effects"] else None


def _reported(record: dict) -> set[str]:
    return {name for e in record["effects"] for name in (e["name"], *e["confusable_with"])}


def _name(effects: list[str]) -> str:
    return " + ".join(sorted(effects)) or "nothing"


def _said(record: dict) -> str:
    return _name([e["name"] for e in record["effects"]]) if record["effects"] else record["verdict"]


def _plain(record: dict) -> bool:
    """Whether a verdict says that the library explains all that matters."""
    return record["verdict"] == "none" or (record["verdict"] == "identified" and not record["remainder"]["matters"])


def _ratio(record: dict, which: str = "held_out") -> float:
    return record["error"]["after"][which] / record["error"]["noise_floor"][which]


def _covered(record: dict) -> list[bool]:
    """Of each parameter of each effect that was named and is there, whether its interval holds the truth."""
    hits = []
    for effect in record["effects"]:
        for name, true in record["values"].get(effect["name"], {}).items():
            if (ends := effect["interval_90"].get(name)) is not None:
                hits.append(ends[0] <= true <= ends[1])
    return hits


def _base_covered(record: dict) -> list[bool]:
    """Of each parameter of the base model, whether its interval holds the truth."""
    estimated, values = record["base_parameters"], record["base_values"]
    ends = {name: estimated[name]["interval_90"] for name in estimated if name in values}
    return [low <= values[name] <= high for name, (low, high) in ends.items()]


def _closed(record: dict) -> float:
    error = record["error"]
    floor, before = error["noise_floor"]["held_out"], error["before"]["held_out"]
    return (before - error["after"]["held_out"]) / max(before - floor, 1e-9)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    counts = {"singles": ("single", 60), "none": ("none", 20), "outside": ("outside", 22), "pairs": ("pair", 20)}
    for name, (_, count) in counts.items():
        parser.add_argument(f"--{name}", type=int, default=count)
    parser.add_argument("--truth", choices=tuple(_CLOSE), default="own", help="whose equations the robots follow")
    parser.add_argument("--first-seed", type=int, default=1000)
    cores = len(os.sched_getaffinity(0))
    parser.add_argument("--jobs", type=int, default=cores, help="at once, which share the cores")
    parser.add_argument("--out", type=Path, default=Path("../out/blind"))
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--json", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--without", help=argparse.SUPPRESS)
    parser.add_argument("--threads", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--records", type=Path, help="a line of JSON a data set; read first, and kept up to date")
    parser.add_argument("--print", action="store_true", help="what the records say, and nothing more")
    options = parser.parse_args()
    if options.one:
        diagnose_one(options.one, options.json, options.without, options.threads)
        return
    known = blind_records.read(options.records) if options.records else {}
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
                    known[blind_records.place(record)] = record
                    blind_records.write(options.records, known.values())
                sizes = ", ".join(f"{size:.2f}" for size in record["sizes"].values())
                print(
                    f"{record['kind']:8}{record['seed']}  {_name(record['truth'])} ({sizes}) -> {_said(record)}"
                    f"  {record['processor_seconds']:.0f} s of processor",
                    flush=True,
                )
        except KeyboardInterrupt:
            pool.shutdown(cancel_futures=True)
            print(f"interrupted: what {len(records)} of {len(todo)} data sets say\n")
    report(records, options.truth)


if __name__ == "__main__":
    main()
