"""What the owner of a system has: a model with its candidates, and records. Nothing here knows the truth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from benchmarks.small.decoys import DECOYS, changed
from benchmarks.small.kind import Kind
from benchmarks.small.kinds import KINDS
from lacuna import Effect, Parameter, Record, System


@dataclass(frozen=True)
class OfferedModel:
    """`simulate` of one set, made of plain values only, so that it can be pickled."""

    kind: str
    decoys: tuple[str, ...] = ()
    output_amplitude: float = 1.0

    def __call__(self, record: Any, theta: Mapping[str, float]) -> dict[str, np.ndarray]:
        kind, time_s = KINDS[self.kind], record.time_s
        applied = np.asarray(record[kind.input], float)
        sizes = {name: theta[f"{name}.size"] for name in self.decoys}
        if self.decoys:
            applied = changed(applied, time_s, kind.bias + kind.sizes[1], {n: s for n, s in sizes.items() if _in(n)})
        found = kind.model(time_s, applied, theta)
        if self.decoys:
            found = changed(found, time_s, self.output_amplitude, {n: s for n, s in sizes.items() if not _in(n)})
        if "zero" in theta:
            found = found + theta["zero"] + theta["slope"] * time_s / time_s[-1]
        return {kind.output: found}


def _in(name: str) -> bool:
    return DECOYS[name].at_input


@dataclass(frozen=True)
class OfferedRun:
    """One record as the owner has it. Runs with equal `condition` are repeats."""

    name: str
    condition: str
    time_s: np.ndarray
    applied: np.ndarray
    measured: np.ndarray


@dataclass(frozen=True)
class Offered:
    """`parameters`, `effects` and `nuisances` as declared; `options`: further arguments of `lacuna.System`."""

    key: str
    model: OfferedModel
    parameters: tuple[Parameter, ...]
    effects: tuple[Effect, ...]
    nuisances: tuple[Parameter, ...]
    runs: tuple[OfferedRun, ...]
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def kind(self) -> Kind:
        return KINDS[self.model.kind]

    def system(self, simulate: Callable[..., Any] | None = None) -> System:
        """The system as any user would declare it; `simulate` replaces the model if given."""
        return System(
            simulate or self.model,
            self.parameters,
            self.effects,
            outputs=self.kind.output,
            name=self.kind.name,
            nuisances=self.nuisances,
            **self.options,
        )

    @cached_property
    def tables(self) -> list[dict[str, Any]]:
        """The records as any user would pass them: columns and labels."""
        return [
            {"name": r.name, "condition": r.condition, "time_s": r.time_s}
            | {self.kind.input: r.applied, self.kind.output: r.measured}
            for r in self.runs
        ]

    @cached_property
    def records(self) -> tuple[Record, ...]:
        """The same as `Record`s."""
        return tuple(self.record(r.name, r.condition, r.time_s, r.applied, r.measured) for r in self.runs)

    def record(self, name: str, condition: str, time_s: np.ndarray, applied: np.ndarray, output: np.ndarray) -> Record:
        inputs = {self.kind.input: applied}
        return Record(name, "run", condition, time_s, {self.kind.output: output}, inputs=inputs)
