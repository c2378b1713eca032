"""Whether a probability of 0.9 is right nine times in ten."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.blind_figures import wilson

_EDGES = (0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98, 1.0)


@dataclass(frozen=True)
class Bin:
    """Effects whose probabilities lie between two edges: how many, their `mean`, and how many are there."""

    count: int
    mean: float
    there: int


def predicted(records: Sequence[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Of every effect of every explanation that was weighed, its probability, and whether it is there."""
    probability, there = [], []
    for record in records:
        weights = record["weights"]
        for effect in dict.fromkeys(name for effects, _ in weights for name in effects):
            probability.append(sum(weight for effects, weight in weights if effect in effects))
            there.append(effect in record["truth"])
    return np.clip(np.array(probability), 0.0, 1.0), np.array(there, bool)


def bins(probability: np.ndarray, there: np.ndarray) -> list[Bin]:
    """By probability, those without an effect left out."""
    place = np.clip(np.searchsorted(_EDGES, probability, side="right") - 1, 0, len(_EDGES) - 2)
    found = [(probability[place == k], there[place == k]) for k in range(len(_EDGES) - 1)]
    return [Bin(len(p), float(p.mean()), int(t.sum())) for p, t in found if len(p)]


def brier(probability: np.ndarray, there: np.ndarray) -> float:
    """The mean squared difference between probability and truth; 0.25 for who always says one half."""
    return float(np.mean((probability - there) ** 2))


def draw(found: Sequence[Bin], path: Path) -> None:
    """A picture: the share that is there against the probability, with 95 % intervals."""
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
