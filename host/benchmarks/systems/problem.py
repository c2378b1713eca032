"""What every rival is given, what it returns, and how that is judged: the same for all."""

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
    """The right-hand side as a sum, for sparse regression: `inertia` x acceleration = `of[inertia]`, the drive, less
    the sum of `parameter` x `of[parameter]`. Each function takes position, speed and the `inputs`, shape (n,) each, in
    SI units. Candidates that are not such a term are left out. `order` of the equation: with 1, the rate takes the
    place of the acceleration, and there is no speed. `unit` of the output in SI."""

    of: Mapping[str, Callable[..., np.ndarray]]
    inertia: str
    inputs: tuple[str, ...]
    order: int = 2
    unit: float = 1e-3

    def only(self, names: Collection[str]) -> Terms:
        """Only the terms of `names`."""
        return replace(self, of={name: term for name, term in self.of.items() if name in names})


def absent(effects: Iterable[Effect]) -> dict[str, float]:
    """Values of `effects`, by full name, at which all of them are absent."""
    off: dict[str, float] = {}
    for effect in effects:
        off |= effect.typical | dict.fromkeys(effect.size_names, effect.absent)
    return off


@dataclass(frozen=True)
class KnownProblem:
    """A system whose structural error is known. `key` names it in bench.json.

    `simulate(record, theta)` with `parameters` is the model, `effects` are the candidates offered to everybody, `truth`
    those that are present, `expected` the correct verdict of the engine. `fitted` and `held_out`: records; the latter
    are of conditions that nobody fits. `cut` turns `fitted` into what the engine is given, if that is one long record.
    `nuisances` are declared to the engine only; others keep them at their declared values. `terms`, or the reason why
    there are `no_terms`. `model_lines`, `terms_lines`: lines that a person writes for the model with its candidates,
    and for `terms`.
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
        """The parameters of the model with `effects`, with their full names, as declared."""
        of_effects = [(e.full_name(p), p) for e in map(self.library.get, effects) for p in e.parameters]
        return [*((p.name, p) for p in self.parameters), *of_effects]

    def theta(self, record: Record, found: Mapping[str, float]) -> Values:
        """The argument of `simulate`: `found` by full name; effects without values are absent."""
        own = {p.name: p.value for p in (self.nuisances(record) if callable(self.nuisances) else self.nuisances)}
        return Values({p.name: p.value for p in self.parameters} | absent(self.effects) | own | dict(found))

    def predict(self, record: Record, found: Mapping[str, float]) -> np.ndarray:
        """Free-run output for one record, shape (n,)."""
        return np.asarray(self.simulate(record, self.theta(record, found))[self.output])

    def residual(self, found: Mapping[str, float], records: Sequence[Record]) -> np.ndarray:
        """Prediction minus measurement, concatenated over `records`, without missing samples."""
        return np.concatenate([(self.predict(r, found) - r.channels[self.output])[self.there(r)] for r in records])

    def there(self, record: Record) -> np.ndarray:
        """Which samples of a record were measured."""
        return np.isfinite(record.channels[self.output])

    def error_percent(self, predict: Predict) -> float:
        """RMS error on the conditions that nobody fitted, in percent of the standard deviation of the measurements."""
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
