"""What every rival is given, what it hands back, and how that is judged: the same for all."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lacuna import Effect, Parameter, Record
from lacuna.values import Values

Predict = Callable[[Record], np.ndarray]


@dataclass(frozen=True)
class Terms:
    """The right-hand side as a sum, for sparse regression: `inertia` x acceleration = `of[inertia]`, what drives, less
    the sum of `parameter` x `of[parameter]`. Each function takes position, speed and the `inputs`, shape (n,) each, in
    SI units. Candidates that are no such term are not in it. `order`: of the equation, where 1 the rate in place of the
    acceleration, and no speed; `unit` of the output in SI."""

    of: Mapping[str, Callable[..., np.ndarray]]
    inertia: str
    inputs: tuple[str, ...]
    order: int = 2
    unit: float = 1e-3

    def only(self, names: Collection[str]) -> Terms:
        """Those of `names`."""
        return replace(self, of={name: term for name, term in self.of.items() if name in names})


def absent(effects: Iterable[Effect]) -> dict[str, float]:
    """Values of `effects`, by full name, with which none of them is there."""
    off: dict[str, float] = {}
    for effect in effects:
        off |= effect.typical | dict.fromkeys(effect.size_names, effect.absent)
    return off


@dataclass(frozen=True)
class KnownProblem:
    """A system whose structural error is known. `key` names it in bench.json.

    `simulate(record, theta)` with `parameters` is the model, `effects` the candidates that everybody is offered,
    `truth` those of them that are there, `expected` the engine's verdict if it is right. `fitted` and `held_out`:
    records, of which the latter are conditions that nobody fits. `cut` makes of `fitted` what the engine is given,
    where that is one long record. `nuisances` are what the engine is told of; others take their values as they are.
    `terms`, or why there are `no_terms`. `model_lines`, `terms_lines`: what a person writes for the model with its
    candidates, and for `terms`.
    """

    key: str
    name: str
    source: str
    output: str
    simulate: Callable[[Any, Values], Mapping[str, np.ndarray]]
    parameters: Sequence[Parameter]
    effects: Sequence[Effect]
    truth: frozenset[str]
    fitted: tuple[Record, ...]
    held_out: tuple[Record, ...]
    model_lines: int
    terms_lines: int = 0
    terms: Terms | None = None
    no_terms: str = ""
    expected: str = "identified"
    nuisances: Callable[[Record], Sequence[Parameter]] | Sequence[Parameter] = ()
    cut: Callable[[tuple[Record, ...]], Any] = tuple

    @cached_property
    def library(self) -> dict[str, Effect]:
        return {effect.name: effect for effect in self.effects}

    def free(self, effects: Sequence[str] = ()) -> list[Parameter]:
        """The parameters of the model with `effects`, by their full names and as declared."""
        of_effects = [(e.full_name(p), p) for e in map(self.library.get, effects) for p in e.parameters]
        return [*((p.name, p) for p in self.parameters), *of_effects]

    def theta(self, record: Record, found: Mapping[str, float]) -> Values:
        """What `simulate` gets: `found` by full name, effects without one at the value at which they are absent."""
        own = {p.name: p.value for p in (self.nuisances(record) if callable(self.nuisances) else self.nuisances)}
        return Values({p.name: p.value for p in self.parameters} | absent(self.effects) | own | dict(found))

    def predict(self, record: Record, found: Mapping[str, float]) -> np.ndarray:
        """The output of one record, simulated freely, shape (n,)."""
        return np.asarray(self.simulate(record, self.theta(record, found))[self.output])

    def residual(self, found: Mapping[str, float], records: Sequence[Record]) -> np.ndarray:
        """Predicted less measured, of all `records` in a row, without samples that are missing."""
        return np.concatenate([(self.predict(r, found) - r.channels[self.output])[self.there(r)] for r in records])

    def there(self, record: Record) -> np.ndarray:
        """Which of its samples were measured."""
        return np.isfinite(record.channels[self.output])

    def error_percent(self, predict: Predict) -> float:
        """RMS error on the conditions that nobody fitted, in percent of the standard deviation of what was measured."""
        measured = np.concatenate([r.channels[self.output] for r in self.held_out])
        predicted = np.concatenate([predict(r) for r in self.held_out])
        return float(100.0 * np.sqrt(np.mean((predicted - measured) ** 2)) / np.std(measured))


@dataclass(frozen=True)
class RivalAnswer:
    """What a rival found: the mechanisms it `named` (None: it names nothing), a model to `predict` with, and its
    `verdict` where it has one."""

    named: tuple[str, ...] | None
    predict: Predict
    verdict: str = ""
