"""Figures of a blind trial's records: rates with 95 % Wilson intervals, beside requirements and baselines."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import median

from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.residual_error import share_of_gap

CLOSE = {"own": 1.2, "realistic": 1.2, "foreign": 1.3}  # largest error after the diagnosis, in floors, by truth
_ERRORS = ("held_out", "held_out_conditions")
BASELINES = ("best single", "BIC", "greedy", "sparse regression")
KINDS = ("single", "none", "outside", "pair")

_FIRST, _IN_SET, _SIZE = "one effect: named first", "one effect: in the reported set", "mean size of the reported set"
_NONE = "no effect: verdict `none`"
_NOT_PLAIN, _CLOSED = "outside the library: never plainly explained", "outside: half the gap closed by what is learnt"
_NOT_PLAIN_GAP, _CLOSED_GAP = (f"{title}, where there is a gap" for title in (_NOT_PLAIN, _CLOSED))
_BOTH = "two effects: both named"
_HELD_OUT, _CONDITIONS = "identified: error not fitted within {} floors", "the same on conditions not fitted"
_SIZES, _BASE = "90 % intervals of sizes hold the truth", "90 % intervals of base parameters hold the truth"
_REQUIRED: dict[str, dict[str, str]] = {
    title: dict(zip(CLOSE, values, strict=True))
    for title, values in {
        _FIRST: ("0.97", "0.95", "0.90"),
        _IN_SET: ("0.99", "0.98", "0.95"),
        _SIZE: ("1.1", "1.2", "1.4"),
        _NONE: ("0.98", "0.95", "0.95"),
        _NOT_PLAIN: ("0.95", "0.90", "0.85"),
        _CLOSED: ("0.75", "0.70", "0.60"),
        _NOT_PLAIN_GAP: ("-", "-", "-"),
        _CLOSED_GAP: ("-", "-", "-"),
        _BOTH: ("0.85", "0.75", "0.60"),
        _HELD_OUT: ("0.95", "0.90", "0.80"),
        _CONDITIONS: ("0.95", "0.90", "0.80"),
        _SIZES: ("0.85-0.95", "0.85-0.95", "-"),
        _BASE: ("0.85-0.95", "0.85-0.95", "-"),
    }.items()
}


def brief(record: dict) -> dict:
    """The part of a record that a report needs."""
    kept = ("kind", "seed", "truth", "sizes", "values", "base_values", "verdict", "processor_seconds", "baselines")
    kept += tuple(name for name in ("version", "simulations") if name in record)  # absent from older trials
    estimated = record["base_parameters"]
    known = {
        name: {"interval_90": estimated[name]["interval_90"]} for name in record["base_values"] if name in estimated
    }
    effects = [{k: e[k] for k in ("name", "interval_90", "confusable_with")} for e in record["effects"]]
    error = {of: {e: record["error"][of][e] for e in _ERRORS} for of in ("before", "after", "noise_floor")}
    rest = {"effects": effects, "base_parameters": known, "error": error}
    return {k: record[k] for k in kept} | rest | {"remainder": {"matters": record["remainder"]["matters"]}}


def wilson(hits: int, of: int) -> tuple[float, float]:
    """95 % Wilson interval of a share."""
    if of == 0:
        return 0.0, 1.0
    z, share = 1.96, hits / of
    center = (share + z * z / (2 * of)) / (1 + z * z / of)
    half = z * math.sqrt(share * (1 - share) / of + z * z / (4 * of * of)) / (1 + z * z / of)
    return max(center - half, 0.0), min(center + half, 1.0)


def rates(records: Sequence[dict], truth: str) -> dict[str, list[bool]]:
    """Hits and misses by title."""
    single, none, outside, pair = ([r for r in records if r["kind"] == kind] for kind in KINDS)
    named, gaps = [r for r in single + pair if r["verdict"] == "identified"], [r for r in outside if _gap(r)]
    of_conditions = [r for r in named if r["error"]["noise_floor"]["held_out_conditions"]]
    found = {
        _FIRST: [_first(r) in r["truth"] for r in single],
        _IN_SET: [bool(set(r["truth"]) & reported(r)) for r in single],
        _NONE: [r["verdict"] == "none" for r in none],
        _NOT_PLAIN: [not plain(r) for r in outside],
        _CLOSED: [_closed(r) >= 0.5 for r in outside],
        _NOT_PLAIN_GAP: [not plain(r) for r in gaps],
        _CLOSED_GAP: [_closed(r) >= 0.5 for r in gaps],
        _BOTH: [set(r["truth"]) <= {e["name"] for e in r["effects"]} for r in pair],
        _HELD_OUT: [_ratio(r) <= CLOSE[truth] for r in named],
        _CONDITIONS: [_ratio(r, "held_out_conditions") <= CLOSE[truth] for r in of_conditions],
    }
    if truth != "foreign":
        right = [r for r in single + none + pair if {e["name"] for e in r["effects"]} == set(r["truth"])]
        found[_SIZES] = [hit for r in named for hit in _covered(r)]
        found[_BASE] = [hit for r in right for hit in _base_covered(r)]
    return found


def report(records: Sequence[dict], truth: str) -> None:
    """Print the figures of all data sets diagnosed."""
    for what, hits in rates(records, truth).items():
        _print_share(what.format(CLOSE[truth]).replace("`", ""), hits)
        if what == _IN_SET:
            print(f"  {_SIZE} {_mean_size(records):.2f}")
    single, none, outside, _ = ([r for r in records if r["kind"] == kind] for kind in KINDS)
    _print_share("outside the library: unexplained", [r["verdict"] == "unexplained" for r in outside])
    closed = sorted(_closed(r) for r in records if r["kind"] in ("single", "pair") and r["verdict"] == "identified")
    if closed:
        print(f"  median share of the gap closed {median(closed):.2f}")
    for name in BASELINES:
        _print_share(f"baseline {name}: one effect, named alone", [r["baselines"][name] == r["truth"] for r in single])
        _print_share(f"baseline {name}: no effect, says none", [not r["baselines"][name] for r in none])
    for kind, spent in _spent(records).items():
        print(f"processor seconds, {kind:8} median {median(spent):.0f}, longest {spent[-1]:.0f}")
    print("\ntruth -> named")
    for (truth, said), count in sorted(Counter((name_of(r["truth"]), said_of(r)) for r in records).items()):
        print(f"  {count:3d}  {truth:40} {said}")


def table(records: Mapping[str, Sequence[dict]]) -> str:
    """The rates of all truths in Markdown, each beside its requirement."""
    found = {truth: rates(of, truth) for truth, of in records.items()}
    titles = [*found["own"]]
    titles.insert(titles.index(_IN_SET) + 1, _SIZE)
    heads = [f"{truth}, {len(of)} data sets | required" for truth, of in records.items()]
    lines = [f"| | {' | '.join(heads)} |", "|---|" + "---|" * 2 * len(records)]
    for title in titles:
        cells = []
        for truth, of in records.items():
            value = f"{_mean_size(of):.2f}" if title == _SIZE else share_text(found[truth].get(title, []))
            cells.append(f"{value} | {_REQUIRED[title][truth]}")
        lines.append(f"| {title.format('1.2 (foreign: 1.3)')} | {' | '.join(cells)} |")
    each = [_spent(of) for of in records.values()]
    spent = [", ".join(f"{median(s[kind]):.0f}" if kind in s else "-" for kind in KINDS) for s in each]
    lines.append(f"| processor time, median, s: {', '.join(KINDS)} | {' | '.join(f'{s} | -' for s in spent)} |")
    return "\n".join(lines)


def _spent(records: Sequence[dict]) -> dict[str, list[float]]:
    """Processor seconds by kind, in ascending order."""
    by_kind = {kind: sorted(r["processor_seconds"] for r in records if r["kind"] == kind) for kind in KINDS}
    return {kind: spent for kind, spent in by_kind.items() if spent}


def _mean_size(records: Sequence[dict]) -> float:
    """Mean number of effects reported, over robots with one effect for which something is named."""
    sizes = [len(reported(r)) for r in records if r["kind"] == "single" and r["effects"]]
    return sum(sizes) / max(len(sizes), 1)


def share_text(hits: Sequence[bool]) -> str:
    """Hits of how many, with the interval; empty if there is nothing to count."""
    if not hits:
        return ""
    low, high = wilson(sum(hits), len(hits))
    return f"{sum(hits)}/{len(hits)} = {sum(hits) / len(hits):.2f} [{low:.2f}, {high:.2f}]"


def _print_share(what: str, hits: Sequence[bool]) -> None:
    if hits:
        print(f"{what:78} {share_text(hits)}")


def _first(record: dict) -> str | None:
    return record["effects"][0]["name"] if record["effects"] else None


def reported(record: dict) -> set[str]:
    """The effects named, and those that the data cannot distinguish from them."""
    return {name for e in record["effects"] for name in (e["name"], *e["confusable_with"])}


def name_of(effects: Sequence[str]) -> str:
    return " + ".join(sorted(effects)) or "nothing"


def said_of(record: dict) -> str:
    return name_of([e["name"] for e in record["effects"]]) if record["effects"] else record["verdict"]


def plain(record: dict) -> bool:
    """Whether a verdict says that the library explains all that matters."""
    return record["verdict"] == "none" or (record["verdict"] == "identified" and not record["remainder"]["matters"])


def _gap(record: dict) -> bool:
    """Whether the base model's excess error on final held-out trials, or on conditions never fitted, exceeds a tenth of
    the floor (squared): anything smaller is `none` by contract."""
    error = record["error"]
    sides = [(error["before"][side], error["noise_floor"][side]) for side in _ERRORS]
    return any(before**2 - floor**2 > POLICY.relevance * floor**2 for before, floor in sides if before and floor)


def _ratio(record: dict, which: str = "held_out") -> float:
    return record["error"]["after"][which] / record["error"]["noise_floor"][which]


def _covered(record: dict) -> list[bool]:
    """For each parameter of each correctly named effect, whether its interval contains the truth."""
    hits = []
    for effect in record["effects"]:
        for name, true in record["values"].get(effect["name"], {}).items():
            if (ends := effect["interval_90"].get(name)) is not None:
                hits.append(ends[0] <= true <= ends[1])
    return hits


def _base_covered(record: dict) -> list[bool]:
    """For each parameter of the base model, whether its interval contains the truth."""
    estimated, values = record["base_parameters"], record["base_values"]
    ends = {name: estimated[name]["interval_90"] for name in estimated if name in values}
    return [low <= values[name] <= high for name, (low, high) in ends.items()]


def _closed(record: dict) -> float:
    """Share of the gap that was closed; 0 if there is no gap."""
    before, after, floor = (record["error"][which]["held_out"] for which in ("before", "after", "noise_floor"))
    return share_of_gap(before, after, floor) if before > floor else 0.0
