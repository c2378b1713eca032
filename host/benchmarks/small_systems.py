"""Small systems other than robots, from seeds: the engine's verdicts, and the answers of other methods.

    python -m benchmarks.small_systems --records small.jsonl                        a full trial, or the rest of one
    python -m benchmarks.small_systems --records small.jsonl --singles 7 --none 0 --withheld 0 --pairs 0 --decoys 0
    python -m benchmarks.small_systems --records small.jsonl --print                only print its figures
    python -m benchmarks.small_systems --show single 7003                           show a set with its seal opened
    python -m benchmarks.small_systems --records small.jsonl --against OTHER.jsonl  compare set by set

Thermal, electrical, hydraulic, a drive, an oscillator, a battery, a reactor (`benchmarks/small/kinds`): one effect,
none, one that is not offered, two, or twenty decoys. Truths follow other formulas than the candidates and are
integrated by other code; undecidable sets are redrawn (`benchmarks/small/distinct.py`). Each set goes through
`lacuna.System` and `lacuna.diagnose` as any user's would. FILE has one line per set, and a trial resumes from it;
beside it, compressed, is what the engine tried (.losses.jsonl.gz), for `python -m benchmarks.replay`. Prints the rates
with 95 % Wilson intervals.
"""

import argparse
import sys
import time
from pathlib import Path

from benchmarks import records as lines
from benchmarks.blind_figures import name_of, said_of
from benchmarks.search_record import losses_beside, version
from benchmarks.small.draw import Sealed, UntellableError, drawn
from benchmarks.small.figures import report
from benchmarks.small.offered import Offered
from benchmarks.small.run import asked, diagnosed, opened, predicted_off

COUNTS = {"singles": ("single", 56), "none": ("none", 21), "withheld": ("outside", 21), "pairs": ("pair", 21)}
COUNTS["decoys"] = ("decoys", 28)


def jobs(counts: dict[str, int], first_seed: int) -> list[tuple[str, int]]:
    """(truth, seed) of each job, truths mixed in proportion, so that an interrupted trial has some of each."""
    placed = [
        ((k + 0.5) / count, truth, first_seed + 1000 * place + k)
        for place, (truth, count) in enumerate(counts.items())
        for k in range(count)
    ]
    return [(truth, seed) for _, truth, seed in sorted(placed)]


def one(truth: str, seed: int, with_peers: bool) -> tuple[dict, dict]:
    """The two records of one set: verdict and truth, and the search."""
    offered, sealed = drawn(truth, seed)
    said, tried, predict = diagnosed(offered)
    record = {"kind": truth, "seed": seed} | opened(offered, sealed) | said | {"version": version()}
    record["off"] = predicted_off(offered, sealed, predict) if predict else None
    if with_peers:
        record["peers"] = asked(offered, sealed)
    return record, {"kind": truth, "seed": seed, "truth": record["on_offer"]} | tried


def run(todo: list[tuple[str, int]], path: Path, with_peers: bool) -> list[dict]:
    """Run what is not in the file yet; Ctrl-C leaves the file intact."""
    known, losses = lines.read(path, "kind", "seed"), lines.read(losses_beside(path), "kind", "seed")
    compiled()
    began = time.monotonic()
    for count, (truth, seed) in enumerate(todo, 1):
        if (truth, seed) in known:
            if with_peers and "peers" not in known[truth, seed]:
                known[truth, seed]["peers"] = asked(*drawn(truth, seed))
                lines.write(path, known.values())
            continue
        try:
            record, tried = one(truth, seed, with_peers)
        except UntellableError as error:
            print(f"left out: {error}", flush=True)
            continue
        known[truth, seed], losses[truth, seed] = record, tried
        lines.write(losses_beside(path), losses.values())
        lines.write(path, known.values())  # last: an interrupted set is diagnosed again
        print(
            f"{count:3d} of {len(todo)}  {time.monotonic() - began:5.0f} s  {truth:8}{seed}  {record['system']:11}"
            f"{name_of(record['truth']):32} -> {said_of(record)}  {record['processor_seconds']:.1f} s of processor",
            flush=True,
        )
    return [known[job] for job in todo if job in known]


def compiled() -> None:
    """Trigger just-in-time compilation, so that no set's time includes it."""
    for seed in range(7):
        offered, _ = drawn("none", seed)
        offered.model(offered.records[0], {})


def show(offered: Offered, sealed: Sealed) -> None:
    """Print a set as its owner has it, and its truth."""
    kind = offered.kind
    print(f"{offered.key}: {kind.name}, {kind.input} -> {kind.output}; {len(offered.runs)} records")
    for p in offered.parameters:
        print(f"  {p.name:24}{p.value:<10g}{p.unit:10} truly {sealed.values[p.name]:.4g}")
    for effect in offered.effects:
        there = "  <- there" if effect.name in sealed.effects else ""
        print(f"  {effect.name:24}{', '.join(f'{p.name} {p.value:g}' for p in effect.parameters)}{there}")
    print(f"  declared: {offered.options or 'nothing more'}; nuisances: {len(offered.nuisances)}")
    print(f"  sealed: {name_of(sealed.effects)} ({'; '.join(sealed.formulas) or '-'})\n  {sealed.instrument}")


def against(these: Path, others: Path) -> None:
    """Print the sets on which two files differ."""
    mine, theirs = lines.read(these, "kind", "seed"), lines.read(others, "kind", "seed")
    both = [key for key in mine if key in theirs]
    print(f"{len(both)} sets in both; said differently of:")
    for key in both:
        before, after = said_of(theirs[key]), said_of(mine[key])
        if before != after:
            print(f"  {key[0]:9}{key[1]}  {name_of(mine[key]['truth']):36} {before:40} -> {after}")


def main(given: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, (_, count) in COUNTS.items():
        parser.add_argument(f"--{name}", type=int, default=count, metavar="N", help=f"sets, {count} by default")
    parser.add_argument("--first-seed", type=int, default=7000, metavar="SEED")
    parser.add_argument("--records", type=Path, default=Path("../out/small.jsonl"), metavar="FILE")
    parser.add_argument(
        "--without-peers", action="store_true", help="the engine alone; a later run without this adds the peers"
    )
    parser.add_argument("--print", action="store_true", help="only print the figures of the records")
    parser.add_argument("--show", nargs=2, metavar=("TRUTH", "SEED"), help="show one set with its seal opened")
    parser.add_argument("--against", type=Path, metavar="FILE", help="print sets with another verdict in this file")
    options = parser.parse_args(given)
    if options.show:
        try:
            show(*drawn(options.show[0], int(options.show[1])))
        except (ValueError, UntellableError) as error:
            parser.error(f"--show single|none|outside|pair|decoys SEED: {error}")
        return 0
    if (options.print or options.against) and not options.records.exists():
        parser.error(f"{options.records}: no such file; run without --print first")
    if options.against:
        if not options.against.exists():
            parser.error(f"{options.against}: no such file; --against takes the records of another run")
        against(options.records, options.against)
        return 0
    if options.print:
        report(list(lines.read(options.records, "kind", "seed").values()))
        return 0
    options.records.parent.mkdir(parents=True, exist_ok=True)
    todo = jobs({truth: getattr(options, name) for name, (truth, _) in COUNTS.items()}, options.first_seed)
    try:
        found = run(todo, options.records, not options.without_peers)
    except KeyboardInterrupt:
        found = list(lines.read(options.records, "kind", "seed").values())
        print(f"interrupted: figures of {len(found)} sets; the same command resumes\n")
    report(found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
