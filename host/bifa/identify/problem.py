"""Residuals of many trials and their derivatives, computed on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache

import numpy as np

from bifa.identify.noise import NoiseFloor
from bifa.identify.structure import Structure
from bifa.identify.system import Channels, Parameter, Trial

LARGEST_STEP, SMALLEST_STEP = 0.02, 1e-5  # of a parameter's scale, for derivatives
SOFT_LIMIT = 10.0  # standard deviations beyond which a residual counts less than its square
_OWN_STARTS = 8  # values tried of a parameter that a trial has its own of
_FAILED = 1e4  # residual, in standard deviations, of a simulation that failed


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max(1, len(os.sched_getaffinity(0))))


def in_parallel(function: Callable, items: Iterable) -> list:
    """`[function(x) for x in items]` on all cores, by threads: simulations release the GIL."""
    return list(_pool().map(function, items))


@dataclass(frozen=True)
class Point:
    """Where a problem stands: the structure's vector, shape (P,), and each trial's nuisances, shape (q,) each."""

    values: np.ndarray
    nuisances: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class Steps:
    """How far derivatives step, in the parameters' units, in the form of a `Point`."""

    structure: np.ndarray
    nuisances: tuple[np.ndarray, ...]


class Problem:
    """The residuals of `trials` under a structure, weighted by a noise floor.

    A residual is (predicted - measured) / sd / sqrt(samples per independent piece), so that half its sum of
    squares is a log-likelihood in independent pieces of information, not in samples. Beyond `SOFT_LIMIT`
    standard deviations it is compressed (asinh), so that a jump at a slightly wrong time does not outweigh
    everything else.
    """

    def __init__(self, structure: Structure, trials: Sequence[Trial], floor: NoiseFloor):
        self.structure = structure
        self.trials = tuple(trials)
        self.floor = floor
        self.nuisances = tuple(structure.nuisances(t) for t in trials)
        self._weighing = [_weighing(t, floor) for t in trials]
        self._prior = structure.prior_precision()
        self._own = [structure.own(t) for t in trials]

    def start(self, values: np.ndarray | None = None, known: Sequence[np.ndarray] | None = None) -> Point:
        """The structure's vector `values` (default its start), nuisances at their means or, the first ones of each
        trial, as `known`. An effect's own parameters of a trial begin at the best of a few values."""
        start = self.structure.start() if values is None else np.asarray(values, float)
        nuisances = [np.array([p.value for p in ps]) for ps in self.nuisances]
        for mine, given in zip(nuisances, known or (), strict=False):
            mine[: len(given)] = given
        own = [(i, len(ps) - k - 1) for i, ps in enumerate(self.nuisances) for k in range(len(self._own[i]))]
        in_parallel(lambda job: self._scan(start, nuisances, *job), own)
        return Point(start, tuple(nuisances))

    def _scan(self, values: np.ndarray, nuisances: list[np.ndarray], index: int, k: int) -> None:
        """Set nuisance `k` of trial `index` to the best of `_OWN_STARTS` values over its range."""
        parameter = self.nuisances[index][k]
        best = np.inf
        tried = nuisances[index].copy()
        for value in np.linspace(parameter.lower, parameter.upper, _OWN_STARTS, endpoint=False):
            tried[k] = value
            residuals = self._weigh(self._simulate(values, tried, index, coarse=True), index)
            if (cost := float(residuals @ residuals)) < best:
                best, nuisances[index] = cost, tried.copy()

    def predict(self, point: Point, index: int, *, coarse: bool = False) -> Channels:
        """Channels of trial `index`."""
        return self._simulate(point.values, point.nuisances[index], index, coarse)

    def predict_all(self, point: Point) -> list[Channels]:
        return in_parallel(lambda i: self.predict(point, i), range(len(self.trials)))

    def residuals(self, point: Point) -> list[np.ndarray]:
        """One vector a trial, channels one after the other, weighted."""
        return in_parallel(lambda i: self._weigh(self.predict(point, i), i), range(len(self.trials)))

    def prior_cost(self, point: Point) -> float:
        """Minus log of the priors on the nuisances and on the learnt curves."""
        cost = 0.5 * self.prior_shift(point) @ self._prior @ self.prior_shift(point)
        for values, parameters in zip(point.nuisances, self.nuisances, strict=True):
            cost += 0.5 * sum(((v - p.value) / p.step_scale) ** 2 for v, p in zip(values, parameters, strict=True))
        return float(cost)

    def prior_shift(self, point: Point) -> np.ndarray:
        """How far the structure's vector is from the mean of its prior."""
        return point.values - self.structure.prior_mean()

    @property
    def prior_precision(self) -> np.ndarray:
        return self._prior

    def first_steps(self) -> Steps:
        """A tenth of the largest step."""
        share = 0.1 * LARGEST_STEP
        return Steps(
            share * self.structure.scales(),
            tuple(np.array([share * p.step_scale for p in ps]) for ps in self.nuisances),
        )

    def tuned_steps(self, steps: Steps, free: Sequence[int], squares: Sequence[np.ndarray]) -> Steps:
        """Steps that change the residuals by a few standard deviations in all: wide enough to drown the
        integrator's own error, narrow enough for the derivative to be one. `squares`: of each trial the square
        norms of its derivatives, by the free parameters and by its nuisances."""
        scales, p = self.structure.scales(), len(free)
        structure = steps.structure.copy()
        structure[list(free)] = _tuned(sum(s[:p] for s in squares), scales[list(free)])
        nuisances = tuple(
            _tuned(s[p:], np.array([parameter.step_scale for parameter in ps]))
            for s, ps in zip(squares, self.nuisances, strict=True)
        )
        return Steps(structure, nuisances)

    def jacobians(self, point: Point, free: Sequence[int], steps: Steps) -> list[tuple[np.ndarray, np.ndarray]]:
        """For each trial the derivatives of its residuals, shapes (n, len(free)) and (n, q), by absolute steps."""
        jobs = [(i, None) for i in range(len(self.trials))]
        for i, trial in enumerate(self.trials):
            jobs += [(i, ("structure", k, j)) for k, j in enumerate(free) if self.structure.moves(j, trial)]
            jobs += [(i, ("nuisance", k, k)) for k in range(len(self.nuisances[i]))]
        reference: list[np.ndarray] = in_parallel(
            lambda i: self._weigh(self.predict(point, i, coarse=True), i), range(len(self.trials))
        )
        blocks = [
            (np.zeros((len(r), len(free))), np.zeros((len(r), len(self.nuisances[i])))) for i, r in enumerate(reference)
        ]

        def column(job) -> None:
            i, what = job
            if what is None:
                return
            kind, k, j = what
            values, nuisances = point.values, point.nuisances[i]
            if kind == "structure":
                parameter = self.structure.parameters[j]
                values, step = _stepped(values, j, parameter, steps.structure[j])
            else:
                parameter = self.nuisances[i][j]
                nuisances, step = _stepped(nuisances, j, parameter, steps.nuisances[i][j])
            moved = self._weigh(self._simulate(values, nuisances, i, coarse=True), i)
            blocks[i][kind == "nuisance"][:, k] = (moved - reference[i]) / step

        in_parallel(column, jobs)
        return blocks

    def scaled(self, predictions: Sequence[Channels]) -> list[Channels]:
        """(measured - predicted) / sd for each trial and channel, neither compressed nor thinned; NaN where missing."""
        return [
            {c: (t.channels[c] - p[c]) / self.floor.sd(t, c) for c in t.channels}
            for t, p in zip(self.trials, predictions, strict=True)
        ]

    def slopes(self, point: Point) -> list[np.ndarray]:
        """What a unit of each prediction changes its residual by, one vector a trial, shapes as `residuals`."""
        return in_parallel(lambda i: self._slope(self.predict(point, i), i), range(len(self.trials)))

    def _simulate(self, values: np.ndarray, nuisances: np.ndarray, index: int, coarse: bool) -> Channels:
        theta = self.structure.theta(values)
        corrections = self.structure.corrections(theta)
        theta |= {p.name: float(v) for p, v in zip(self.nuisances[index], nuisances, strict=True)}
        trial = self.trials[index]
        system = self.structure.system
        return system.predict(theta, self.structure.effects, trial, coarse=coarse, corrections=corrections)

    def _weigh(self, prediction: Channels, index: int) -> np.ndarray:
        _, _, thinning, keep = self._weighing[index]
        return SOFT_LIMIT * np.arcsinh(self._deviations(prediction, index) / SOFT_LIMIT) * thinning[keep]

    def _slope(self, prediction: Channels, index: int) -> np.ndarray:
        _, weight, thinning, keep = self._weighing[index]
        return (weight * thinning)[keep] / np.hypot(1.0, self._deviations(prediction, index) / SOFT_LIMIT)

    def _deviations(self, prediction: Channels, index: int) -> np.ndarray:
        """Residuals in standard deviations, uncompressed."""
        measured, weight, _, keep = self._weighing[index]
        predicted = np.concatenate([prediction[c] for c in self.trials[index].channels])
        z = ((predicted - measured) * weight)[keep]
        return np.where(np.isfinite(z), z, _FAILED)


def _weighing(trial: Trial, floor: NoiseFloor) -> tuple[np.ndarray, ...]:
    measured = np.concatenate([trial.channels[c] for c in trial.channels])
    weight = np.concatenate([1.0 / floor.sd(trial, c) for c in trial.channels])
    thinning = np.concatenate(
        [np.full(v.shape, floor.samples_per_piece(trial, c) ** -0.5) for c, v in trial.channels.items()]
    )
    return measured, weight, thinning, np.isfinite(measured)


def _stepped(values: np.ndarray, index: int, parameter: Parameter, step: float) -> tuple[np.ndarray, float]:
    """`values` with one entry moved by `step`, inwards where a bound is near."""
    if values[index] + step > parameter.upper:
        step = -step
    moved = values.copy()
    moved[index] += step
    return moved, step


def _tuned(square_norm: np.ndarray, scales: np.ndarray) -> np.ndarray:
    ideal = 3.0 / np.sqrt(np.maximum(square_norm, 1e-300))
    return np.clip(ideal, SMALLEST_STEP * scales, LARGEST_STEP * scales)
