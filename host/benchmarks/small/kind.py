"""Description of a kind of system: its owner's model, the candidates, and the truth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from benchmarks.small.integrate import modeled, true
from benchmarks.systems.problem import absent
from lacuna import Effect, Parameter


@dataclass(frozen=True)
class Form:
    """A formula of `effect` that the library lacks. `ranges`: its values in the truth's `p` are drawn from these."""

    effect: str
    formula: str
    ranges: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Kind:
    """A kind of system.

    `rates` and `reading`, with `states` states, are the model; its `p` are the parameters of the base, then those of
    `effects` in the order of declaration. `true_rates` and `true_reading`, with `true_states`, are the truth: the same
    base with every form in `forms`; its `p` are the base's parameters, then those named in `true_off`, whose values
    turn the forms off. `start`: the first states at rest. `delay`: the effect that delays the model's input, if any.

    The input is `bias` plus `sizes` times a shape (`excitation.py`), at least `least`; `judged`: sizes of unseen runs.
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
    steps: int = 2  # of the model's integrator per sample
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
        """Values of the base model alone, at its declared values."""
        return {p.name: p.value for p in self.parameters} | absent(self.effects)

    @property
    def step_s(self) -> float:
        return self.duration_s / self.samples / self.steps

    def model(self, time_s: np.ndarray, applied: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Output of the owner's model; candidates without values are off."""
        p = np.array([values.get(name, self.off[name]) for name in self.names])
        delay_s = values.get(f"{self.delay}.delay_s", 0.0) if self.delay else 0.0
        start = self._start(self.states)
        return modeled(self.rates, self.reading, time_s, applied, start, p, delay_s, self.step_s)

    def truth(self, time_s: np.ndarray, applied: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Output of the truth; forms without values are off."""
        p = np.array([values[p.name] for p in self.parameters] + [values.get(k, v) for k, v in self.true_off.items()])
        start = self._start(self.true_states)
        return true(self.true_rates, self.true_reading, time_s, applied, start, p, 0.0, self.step_s)

    def _start(self, states: int) -> np.ndarray:
        x = np.zeros(states)
        x[: len(self.start)] = self.start
        return x
