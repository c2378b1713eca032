"""The search behind a verdict in plain types, on which decision rules are tested later (`benchmarks.replay`).

The only module of the benchmarks that depends on the engine's representation of a search.
"""

import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import lacuna
from benchmarks import records as lines

_DIGITS = 5


def searched(diagnosis: Any, simulations: int) -> dict[str, Any]:
    """The record of a search: for every explanation tried, its total cost (minus log-likelihood, with that of the
    parameters), the loss of each trial (minus log-likelihood), and the RMS residual of trials that it was not fitted
    to, in units of the noise."""
    search, choice, split = diagnosis.search, diagnosis.choice, diagnosis.split
    trials = search.base.trials
    named = {(): search.base} | {c.effects: c for c in search.tried} | {choice.candidate.effects: choice.candidate}
    return {
        "version": version(),
        "simulations": simulations,
        "trials": [t.name for t in trials],
        "conditions": [f"{t.experiment}: {t.condition}" for t in trials],
        "split": {part: [t.name for t in getattr(split, part)] for part in ("fit", "select", "unseen", "final")},
        "pieces": _short(search.base.pieces),
        "tried": [_tried(candidate, trials) for candidate in named.values()],
        "chosen": list(choice.candidate.effects),
        "probability": {name: _short(p) for name, p in choice.probability.items()},
        "weights": [[list(effects), _short(weight)] for effects, weight in choice.weights.items()],
    }


def _tried(candidate: Any, trials: Any) -> dict[str, Any]:
    library = candidate.fitted.structure.system.effects
    return {
        "effects": list(candidate.effects),
        "parameters": sum(len(library[name].parameters) for name in candidate.effects),
        "cost": _short(candidate.cost),
        "losses": [_short(candidate.by_trial[t.name]) for t in trials],
        "errors": {name: _short(error) for name, error in candidate.errors.items()},
    }


def _short(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def losses_beside(path: Path) -> Path:
    """Path of the search records: compressed, beside the records of a trial."""
    return path.with_suffix(".losses.jsonl.gz")


def write_losses(path: Path, record: dict) -> None:
    """Add the search record of one data set to those beside `path`; records read from a file have none."""
    if "search" not in record:
        return
    known = lines.read(losses_beside(path), "kind", "seed")
    of = {name: record[name] for name in ("kind", "seed", "truth")}
    known[record["kind"], record["seed"]] = of | record["search"]
    lines.write(losses_beside(path), known.values())


@cache
def version() -> str:
    """The commit of this checkout, marked if there are changes; for an installed engine, its version."""
    ask = ["git", "describe", "--always", "--dirty", "--abbrev=9"]
    found = subprocess.run(ask, cwd=Path(__file__).parent, capture_output=True, text=True)
    return found.stdout.strip() or lacuna.__version__
