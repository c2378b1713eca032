"""Figures of the records of small systems: rates with 95 % Wilson intervals, beside peers on the same sets."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from benchmarks.blind_figures import name_of, plain, reported, said_of, share_text
from benchmarks.small.kinds.terms import TERMS

_KINDS = ("single", "none", "outside", "pair", "decoys")
_REQUIRED = {
    "one effect: named first": "0.93",
    "one effect: in the reported set": "-",
    "one effect: it alone, nothing else": "-",
    "no effect: verdict `none`": "0.95",
    "withheld: never plainly explained": "0.93",
    "two effects: both named": "0.80",
    "two effects: both, and nothing else": "-",
    "20 decoys: something named that is not there": "at most 0.02",
    "all: something named that is not there": "-",
    "crashed": "0",
}


def named(record: dict) -> list[str]:
    return [effect["name"] for effect in record["effects"]]


def rates(records: Sequence[dict]) -> dict[str, list[bool]]:
    """Hits and misses by title; a crash is a miss."""
    single, none, outside, pair, decoys = ([r for r in records if r["kind"] == kind] for kind in _KINDS)
    found = (
        [named(r)[:1] == r["truth"] for r in single],
        [bool(set(r["truth"]) & reported(r)) for r in single],
        [named(r) == r["truth"] for r in single],
        [r["verdict"] == "none" for r in none],
        [r["verdict"] != "crash" and not plain(r) for r in outside],
        [set(r["truth"]) <= set(named(r)) for r in pair],
        [sorted(named(r)) == r["truth"] for r in pair],
        [_false(r) for r in decoys],
        [_false(r) for r in records],
        [r["verdict"] == "crash" for r in records],
    )
    return dict(zip(_REQUIRED, found, strict=True))


def _false(record: dict) -> bool:
    """Whether an effect is named that is not present."""
    return not set(named(record)) <= set(record["truth"])


def right(record: dict, said: Sequence[str]) -> bool:
    """Whether exactly the effects that are present and offered were named."""
    return sorted(said) == record["on_offer"]


def report(records: Sequence[dict]) -> None:
    """Print the rates, those of the peers, the costs, and the effects named for each truth."""
    print(f"{len(records)} small systems; engine {', '.join(sorted({r['version'] for r in records}))}\n")
    print(f"{'':46}{'found':30}required")
    for title, hits in rates(records).items():
        if hits:
            print(f"{title:46}{share_text(hits):30}{_REQUIRED[title]}")
    count = sum("peers" in r for r in records)
    print(f"\n{count} sets that others were asked, too; right: what is there and on offer, and nothing else")
    print(f"{'':28}{'right':28}{'predicts off by, noises':26}processor, s; simulations")
    print(f"{'':28}{'':28}{'single  none  withheld':26}medians")
    same = [r for r in records if "peers" in r] or records  # if peers were run, only on their sets
    hits = [r["verdict"] != "crash" and right(r, named(r)) for r in same]
    print(_row("lacuna", same, hits, same))
    steady = [_steady_share("lacuna", same, hits)]
    for peer in dict.fromkeys(name for r in records for name in r.get("peers", {})):
        asked = [(r, r["peers"][peer]) for r in records if peer in r.get("peers", {}) and _applies(peer, r)]
        saying = [(r, p["named"]) for r, p in asked if p["named"] is not None]
        hits = [right(r, said) for r, said in saying]
        print(_row(peer, [r for r, _ in asked], hits, [p for _, p in asked]))
        steady += [_steady_share(peer, [r for r, _ in saying], hits)] if hits else []
    print("right where nothing drifts", *steady, sep="\n")
    print("\nby kind of system: one effect named first, no effect `none`, both of two named")
    for system in dict.fromkeys(r["system"] for r in records):
        found = list(rates([r for r in records if r["system"] == system]).values())
        shares = [f"{sum(hits)}/{len(hits)}" for hits in (found[0], found[3], found[5])]
        print(f"  {system:14}{'   '.join(shares)}")
    print("\ntruth -> said")
    for kind in _KINDS:
        pairs = Counter((name_of(r["truth"]), said_of(r)) for r in records if r["kind"] == kind)
        for (truth, said), count in sorted(pairs.items()):
            print(f"  {kind:9}{count:3d}  {truth:38} {said}")


def _steady_share(name: str, records: Sequence[dict], hits: Sequence[bool]) -> str:
    steady = [hit for r, hit in zip(records, hits, strict=True) if "drifts" not in r.get("instrument", ())]
    return f"{name:28}{share_text(steady)}"


def _row(name: str, records: Sequence[dict], hits: Sequence[bool], answers: Sequence[dict]) -> str:
    off = []
    for kind in ("single", "none", "outside"):
        found = [a["off"] for r, a in zip(records, answers, strict=True) if r["kind"] == kind and a["off"] is not None]
        off.append(f"{np.median(found):<8.2g}" if found else "-       ")
    cost = f"{np.median([a['processor_seconds'] for a in answers]):.1f}"
    if name == "lacuna":
        cost += f"; {np.median([a['simulations'] for a in answers]):.0f}"
    return f"{name:28}{share_text(hits) if hits else '(names nothing)':28}{''.join(off):26}{cost}"


def _applies(peer: str, record: dict) -> bool:
    """Whether a peer applies: sparse regression only if the effects are terms of a sum."""
    if not peer.startswith("sparse"):
        return True
    terms = {name.split(".")[0] for name in TERMS[record["system"]].of}
    return set(record["on_offer"]) <= terms
