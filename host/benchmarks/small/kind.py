"""What is told of a kind of system: the model that its owner has, its candidates, and what is true instead."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from benchmarks.small.integrate import modeled, true
from benchmarks.systems.problem import absent
from lacuna import Effect, Parameter


@dataclass(frozen=True)
class Form:
    """A formula of `effect` that the library has not. `ranges`: its values in the truth's `p`, drawn between these."""

    effect: str
    formula: str
    ranges: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Kind:
    """A kind of system.

    `rates`, `reading` with `states` are the model: its `p` are the parameters of the base and then those of `effects`,
    in the order of their declaration. `true_rates`, `true_reading` with `true_states`: the same base, and every form in
    `forms`, whose `p` are the base's parameters and then `true_off`, values at which there is no effect. `start`: of
    the first states, at rest. `delay`: the effect by which the model's input is late, if there is one.

    The input is `bias` plus `sizes` times a shape (`excitation.py`), at least `least`; `judged` are further sizes.
    """

    key: str
    name: str
    output: str
    input: str
    parameters: tuple[Parameter, ...]
    effects: tuple[Effect, ...]
    rates: Callable
    reading: Callable
    states: int
    forms: tuple[Form, ...]
    true_off: Mapping[str, float]
    true_rates: Callable
    true_reading: Callable
    true_states: int
    duration_s: float
    samples: int
    sizes: tuple[float, float]
    judged: tuple[float, float]
    steps: int = 2  # of the model's integrator in a sample
    bias: float = 0.0
    least: float = -np.inf
    start: tuple[float, ...] = ()
    delay: str = ""

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Full names of the model's `p`."""
        return (*(p.name for p in self.parameters), *(e.full_name(p) for e in self.effects for p in e.parameters))

    @cached_property
    def off(self) -> dict[str, float]:
        """The model's values with nothing but the base, at its declared values."""
        return {p.name: p.value for p in self.parameters} | absent(self.effects)

    @property
    def step_s(self) -> float:
        return self.duration_s / self.samples / self.steps

    def model(self, time_s: np.ndarray, applied: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """The owner's model; candidates without values are off."""
        p = np.array([values.get(name, self.off[name]) for name in self.names])
        delay_s = values.get(f"{self.delay}.delay_s", 0.0) if self.delay else 0.0
        start = self._start(self.states)
        return modeled(self.rates, self.reading, time_s, applied, start, p, delay_s, self.step_s)

    def truth(self, time_s: np.ndarray, applied: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """What really happens; forms without values are not there."""
        p = np.array([values[p.name] for p in self.parameters] + [values.get(k, v) for k, v in self.true_off.items()])
        start = self._start(self.true_states)
        return true(self.true_rates, self.true_reading, time_s, applied, start, p, 0.0, self.step_s)

    def _start(self, states: int) -> np.ndarray:
        x = np.zeros(states)
        x[: len(self.start)] = self.start
        return x
