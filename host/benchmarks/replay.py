"""Test decision rules, in seconds, on the records of blind trials, and check how reliable probabilities were.

    python -m benchmarks.replay small.jsonl                                   every rule of benchmarks/rules.py
    python -m benchmarks.replay small.jsonl benchmarks/recorded/foreign.jsonl  on both together
    python -m benchmarks.replay small.jsonl --rule my_rules:careful           a function of your own as well
    python -m benchmarks.replay small.jsonl --reliability picture.png         probabilities against the truth

FILE is what `benchmarks.small_systems --records` or `benchmarks.blind --records` wrote; the losses of every explanation
that was tried are beside it (.losses.jsonl.gz). No model is simulated: a rule chooses among what the search had found.
"""

import argparse
import importlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import records as lines
from benchmarks.blind_figures import share_text, wilson
from benchmarks.rules import RULES, Rule
from benchmarks.search_record import losses_beside

_KINDS = {"single": "one effect", "none": "none", "outside": "withheld", "pair": "two", "decoys": "20 decoys"}
_EDGES = (0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98, 1.0)  # of the bins of probabilities


def searches(path: Path) -> list[dict[str, Any]]:
    """The search record of each set, with the `kind` of its truth, the offered effects that are present (`truth`), and
    those that the verdict `named`."""
    tried = lines.read(losses_beside(path), "kind", "seed")
    if not tried:
        raise SystemExit(f"{losses_beside(path)}: no search records. Run the trial with --records {path}.")
    return [
        _joined(record, tried[key])
        for key, record in lines.read(path, "kind", "seed").items()
        if tried.get(key, {}).get("tried")
    ]


def _joined(record: dict[str, Any], tried: dict[str, Any]) -> dict[str, Any]:
    on_offer = record.get("on_offer", [] if record["kind"] == "outside" else record["truth"])
    return tried | {"truth": sorted(on_offer), "named": [e["name"] for e in record["effects"]]}


def replayed(found: Sequence[dict[str, Any]], rules: dict[str, Rule]) -> str:
    """A table of rules: by kind of truth, how often each names exactly the effects that are present and offered; and
    how often it names one that is absent."""
    kinds = [kind for kind in _KINDS if any(s["kind"] == kind for s in found)]
    heads = "".join(f"{_KINDS[kind]:12}" for kind in kinds)
    rows = [
        f"{len(found)} sets: exactly what is there, no more and no fewer\n",
        f"{'':30}{heads}names what is not there",
    ]
    for name, rule in {"the verdict": lambda search: search["named"], **rules}.items():
        said = [sorted(rule(s)) for s in found]
        cells = ""
        for kind in kinds:
            hits = [n == s["truth"] for n, s in zip(said, found, strict=True) if s["kind"] == kind]
            cells += f"{f'{sum(hits)}/{len(hits)}':12}"
        false = [not set(n) <= set(s["truth"]) for n, s in zip(said, found, strict=True)]
        rows.append(f"{name:30}{cells}{share_text(false)}")
    return "\n".join(rows)


def reliable(found: Sequence[dict[str, Any]], picture: Path | None) -> str:
    """How often effects of each probability are present, for all sets and for those without a withheld effect."""
    offered = [s for s in found if s["kind"] != "outside"]
    if picture:
        draw(bins(*predicted(found)), picture)
    cases = {"": found, ", without those whose effect is withheld": offered if len(offered) < len(found) else []}
    return "\n\n".join(_reliable(sets, of) for of, sets in cases.items() if sets)


def _reliable(found: Sequence[dict[str, Any]], of: str) -> str:
    probability, there = predicted(found)
    if not len(probability):
        return f"no explanation was weighed{of}: there are no probabilities"
    rows = [f"{len(probability)} probabilities{of}; Brier score {brier(probability, there):.4f}", "said    is there"]
    for one in bins(probability, there):
        rows.append(f"{one.mean:<8.3f}{share_text([True] * one.there + [False] * (one.count - one.there))}")
    return "\n".join(rows)


@dataclass(frozen=True)
class Bin:
    """Effects whose probabilities lie between two edges: how many, their `mean`, and how many are present."""

    count: int
    mean: float
    there: int


def predicted(records: Sequence[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Probability of every effect in the explanations that were weighed, and whether it is present."""
    probability, there = [], []
    for record in records:
        weights = record["weights"]
        for effect in dict.fromkeys(name for effects, _ in weights for name in effects):
            probability.append(sum(weight for effects, weight in weights if effect in effects))
            there.append(effect in record["truth"])
    return np.clip(np.array(probability), 0.0, 1.0), np.array(there, bool)


def bins(probability: np.ndarray, there: np.ndarray) -> list[Bin]:
    """Effects binned by probability, without empty bins."""
    place = np.clip(np.searchsorted(_EDGES, probability, side="right") - 1, 0, len(_EDGES) - 2)
    found = [(probability[place == k], there[place == k]) for k in range(len(_EDGES) - 1)]
    return [Bin(len(p), float(p.mean()), int(t.sum())) for p, t in found if len(p)]


def brier(probability: np.ndarray, there: np.ndarray) -> float:
    """The mean squared difference between probability and truth; 0.25 for a constant one half."""
    return float(np.mean((probability - there) ** 2))


def draw(found: Sequence[Bin], path: Path) -> None:
    """Write a plot of the share that is present against the probability, with 95 % intervals."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2, 4.2), layout="constrained")
    axis = figure.subplots()
    axis.plot([0, 1], [0, 1], color="0.6", linewidth=0.8)
    for one in found:
        low, high = wilson(one.there, one.count)
        axis.plot([one.mean, one.mean], [low, high], color="C0", linewidth=1.2)
        axis.plot(one.mean, one.there / one.count, "o", color="C0", markersize=4)
        axis.annotate(f" {one.count}", (one.mean, one.there / one.count), fontsize=8)
    axis.set_xlabel("probability said")
    axis.set_ylabel("share that is there (of so many)")
    axis.set_xlim(-0.03, 1.08)
    axis.set_ylim(-0.03, 1.05)
    figure.savefig(path, dpi=150)


def own(spec: str) -> Rule:
    """Import a rule given as `module:function`, also from the current folder."""
    sys.path.insert(0, str(Path.cwd()))
    module, _, name = spec.partition(":")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise SystemExit(f"--rule {spec}: {error}. Write it as module:function.") from None


def main(given: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE")
    parser.add_argument("--rule", action="append", default=[], metavar="MODULE:FUNCTION", help="a rule of your own")
    parser.add_argument("--reliability", type=Path, metavar="PNG", help="plot probabilities against the truth")
    options = parser.parse_args(given)
    found = [search for path in options.files for search in searches(path)]
    print(replayed(found, RULES | {spec: own(spec) for spec in options.rule}), end="\n\n")
    print(reliable(found, options.reliability))
    return 0


if __name__ == "__main__":
    sys.exit(main())
