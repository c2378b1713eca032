"""Weighted residuals of many trials and their derivatives, computed on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from lacuna.estimation.noise import NoiseFloor
from lacuna.estimation.sampling import even_grid
from lacuna.estimation.sensitivity import Sensitivity
from lacuna.estimation.structure import Structure
from lacuna.system import Channels, Parameter, Record

LARGEST_STEP, SMALLEST_STEP = 0.02, 1e-5  # of finite differences, in scales of the parameter
SOFT_LIMIT = 10.0  # standard deviations beyond which a residual counts less than its square
_OWN_STARTS = 8  # initial values tried for each of an effect's own parameters of a trial
_CACHE_SIZE = 4  # points whose residuals are cached
_MIN_PACK_SIZE = 3  # trials; fewer gain less from being simulated side by side than from a core each
FAILED = 1e4  # residual, in standard deviations, of a simulation that failed
_MAX_DEVIATION = 1e8  # standard deviations; predictions that diverge further are clipped, or squares would overflow


_threads: int | None = None


def usable_cores() -> int:
    """Number of cores this process may run on; all of them if the system cannot tell (macOS, Windows)."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def cores() -> int:
    """Number of cores on which this process simulates."""
    return _threads or usable_cores()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(cores())


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # a forked child inherits the pool without its threads


def use_threads(count: int | None) -> None:
    """Set the number of threads on which this process simulates; None: one per core."""
    global _threads
    _threads = count
    _pool.cache_clear()


def in_parallel(function: Callable[..., Any], items: Iterable[Any], work: Sequence[float] = ()) -> list[Any]:
    """Return `[function(x) for x in items]`, computed by threads on all cores (simulations release the GIL). Items with
    the most `work` start first, so that cores do not idle at the end."""
    if cores() == 1:
        return list(map(function, items))
    items = list(items)
    order = sorted(range(len(items)), key=lambda k: -work[k]) if work else range(len(items))
    found = dict(zip(order, _pool().map(function, [items[k] for k in order]), strict=True))
    return [found[k] for k in range(len(items))]


@dataclass(frozen=True)
class Point:
    """A point in parameter space: the structure's vector, shape (P,), and each trial's nuisances, shape (q,) each."""

    values: np.ndarray
    nuisances: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class View:
    """How residuals are smoothed and weighted during a fit.

    `blur`: time constant of a low-pass filter applied to them first, as a share of the trial's duration (0: none).
    `raised`: factor by which the floor's standard deviation is raised. Residuals beyond `soft_limit` standard
    deviations are compressed (asinh).
    """

    blur: float = 0.0
    raised: float = 1.0
    soft_limit: float = SOFT_LIMIT


SHARP = View()
PLAIN = View(soft_limit=1e6)  # plain least squares, the criterion of an RMS error


class Problem:
    """The residuals of `trials` under a structure, weighted by a noise floor.

    A residual is (predicted - measured) / sd / sqrt(samples per independent piece), so that half the sum of squares is
    minus a log-likelihood that counts independent pieces of information, not samples. Large ones are compressed
    (`View`), so that a jump predicted at a slightly wrong time does not outweigh everything else.
    """

    def __init__(self, structure: Structure, trials: Sequence[Record], floor: NoiseFloor, view: View = SHARP):
        self.structure, self.view = structure, view
        self.trials = tuple(trials)
        self.floor = floor
        self.nuisances = tuple(structure.nuisances(t) for t in trials)
        self._weighing = [_Weighing.of(t, floor) for t in trials]
        self._spans = [{c: _span(v, floor.sd(t, c)) for c, v in t.channels.items()} for t in trials]
        self._grids = [[even_grid(t.time_s[np.isfinite(v)]) for v in t.channels.values()] for t in trials]
        self._prior = structure.prior_precision()
        self._own = [structure.own(t) for t in trials]
        # cached residuals by point, since a search often begins where the previous one ended
        self._recent: dict[tuple[Any, ...], list[np.ndarray]] = {}
        self.sizes = [len(w.keep) for w in self._weighing]  # samples of all channels of each trial
        self._together = _pack_trials(self.trials, structure.system.at_once)

    def __getstate__(self) -> dict[str, Any]:
        """State for pickling, without the cached residuals."""
        return vars(self) | {"_recent": {}}

    def start(self, values: np.ndarray | None = None, known: Sequence[np.ndarray] | None = None) -> Point:
        """Return a point to start from: the structure's vector `values` (default: its start), nuisances at their means
        or as `known` (the leading ones of each trial), and effects' own parameters at the best of a few values."""
        start = self.structure.start() if values is None else np.asarray(values, float)
        nuisances = [np.array([p.value for p in ps]) for ps in self.nuisances]
        for mine, given in zip(nuisances, known or (), strict=False):
            mine[: len(given)] = given[: len(mine)]
        in_parallel(lambda i: self._scan(start, nuisances, i), [i for i, own in enumerate(self._own) if own])
        return Point(start, tuple(nuisances))

    def _scan(self, values: np.ndarray, nuisances: list[np.ndarray], index: int) -> None:
        """Set each of the effects' own parameters of a trial, the last first, to the best of `_OWN_STARTS` values."""
        for k in range(-1, -len(self._own[index]) - 1, -1):
            parameter = self.nuisances[index][k]
            tried = np.tile(nuisances[index], (_OWN_STARTS, 1))
            away = 2.0 * parameter.step_scale  # without bounds
            low, high = max(parameter.lower, parameter.value - away), min(parameter.upper, parameter.value + away)
            ends = (parameter.lower, parameter.upper) if np.isfinite(parameter.upper - parameter.lower) else (low, high)
            tried[:, k] = np.linspace(*ends, _OWN_STARTS, endpoint=False)
            found = self._simulate([(values, mine) for mine in tried], index, coarse=True)
            costs = np.sum(self._weigh(found, index) ** 2, axis=1)
            nuisances[index] = tried[int(np.argmin(costs))]

    def seen(self, view: View) -> Problem:
        """Return the same problem with another view of its residuals."""
        other = copy(self)
        other.view = view
        return other

    def with_prior(self, *, relax_priors: bool = False, sizes: Mapping[str, float] | None = None) -> Problem:
        """Return the same problem with another prior (`Structure.prior_precision`)."""
        other = copy(self)
        other._prior = self.structure.prior_precision(relax_priors, sizes)
        return other

    def over(self, trials: Sequence[Record], floor: NoiseFloor | None = None) -> Problem:
        """Return the same problem with other trials and, if given, another floor."""
        other = Problem(self.structure, trials, floor or self.floor, self.view)
        other._prior = self._prior
        return other

    def predict_all(self, point: Point) -> list[Channels]:
        """Predictions of every trial; NaN where they diverge, since their squares may overflow."""

        def masked(prediction: Channels, index: int) -> Channels:
            spans = self._spans[index]
            with np.errstate(invalid="ignore"):
                far = {c: np.abs(prediction[c]) > _MAX_DEVIATION * span for c, span in spans.items()}
            return {c: np.where(far[c], np.nan, prediction[c]) if far[c].any() else prediction[c] for c in spans}

        return self._of_each(point, masked)

    def residuals(self, point: Point) -> list[np.ndarray]:
        """Weighted residuals, one vector per trial, with the channels one after the other."""
        key = (self.view, point.values.tobytes(), *(q.tobytes() for q in point.nuisances))
        if key not in self._recent:
            coarse = self.view.raised > 1.0
            found = self._of_each(point, lambda prediction, i: self._weigh([prediction], i)[0], coarse=coarse)
            while len(self._recent) >= _CACHE_SIZE:
                del self._recent[next(iter(self._recent))]
            self._recent[key] = found
        return self._recent[key]

    def prior_cost(self, point: Point) -> float:
        """Minus the log of the priors on the structure's vector and on the nuisances."""
        cost = self.structure_prior_cost(point)
        for values, parameters in zip(point.nuisances, self.nuisances, strict=True):
            cost += 0.5 * sum(((v - p.value) / p.step_scale) ** 2 for v, p in zip(values, parameters, strict=True))
        return float(cost)

    def structure_prior_cost(self, point: Point) -> float:
        """Minus the log of the prior on the structure's vector, which all trials share."""
        return 0.5 * self.prior_shift(point) @ self.prior_precision @ self.prior_shift(point)

    def prior_shift(self, point: Point) -> np.ndarray:
        """Difference between the structure's vector and the mean of its prior."""
        return point.values - self.structure.prior_mean()

    @property
    def prior_precision(self) -> np.ndarray:
        """Precision of the prior on the structure's vector, shape (P, P), reduced in proportion to a raised floor."""
        return self._prior / self.view.raised**2

    def first_steps(self) -> Point:
        """Initial steps of the derivatives, in the parameters' units: a tenth of the largest step."""
        share = 0.1 * LARGEST_STEP
        return Point(
            np.maximum(share * self.structure.scales(), self.structure.grains()),
            tuple(np.array([share * p.step_scale for p in ps]) for ps in self.nuisances),
        )

    def tuned_steps(self, steps: Point, free: Sequence[int], squares: Sequence[np.ndarray]) -> Point:
        """Return steps that change the residuals by a few standard deviations in total: large enough to dominate the
        integrator's error, small enough for a finite difference to approximate the derivative. `squares`: for each
        trial, the squared norms of its derivatives with respect to the free parameters and its nuisances."""
        scales, p = self.structure.scales(), len(free)
        structure = steps.values.copy()
        structure[list(free)] = _tuned(sum((s[:p] for s in squares), start=np.zeros(p)), scales[list(free)])
        structure = np.maximum(structure, self.structure.grains())
        nuisances = tuple(
            _tuned(s[p:], np.array([parameter.step_scale for parameter in ps]))
            for s, ps in zip(squares, self.nuisances, strict=True)
        )
        return Point(structure, nuisances)

    def jacobians(self, point: Point, free: Sequence[int], steps: Point) -> list[Sensitivity]:
        """Derivatives of each trial's residuals with respect to the parameters `free` and the trial's nuisances, by
        finite differences with absolute `steps`."""

        def of_trial(i: int) -> Sensitivity:
            values, nuisances, p = point.values, point.nuisances[i], len(free)
            moving = [k for k, j in enumerate(free) if self.structure.moves(j, self.trials[i])]
            factors = self._factors(i, [free[k] for k in moving])
            stepping = [k for k in range(len(nuisances)) if k not in factors]
            parameters = self.structure.parameters
            by_structure = [_stepped(values, free[k], parameters[free[k]], steps.values[free[k]]) for k in moving]
            by_nuisance = [_stepped(nuisances, k, self.nuisances[i][k], steps.nuisances[i][k]) for k in stepping]
            moved = [*((v, nuisances) for v, _ in by_structure), *((values, n) for n, _ in by_nuisance)]
            changes = self.changes(i, (values, nuisances), moved, coarse=True)
            changes /= np.array([step for _, step in (*by_structure, *by_nuisance)])[:, None]
            by_parameter = {free[k]: row for k, row in zip(moving, changes, strict=False)}
            times_slope = self.structure.system.times_slope
            by_factor = [
                sum(times_slope(parameters[j].name, values[j]) * by_parameter[j] for j in of) / nuisances[k]
                for k, of in factors.items()
            ]
            active = [*moving, *(p + k for k in (*stepping, *factors))]
            return Sensitivity.of(np.vstack([changes, *by_factor]), active, p, len(nuisances))

        return in_parallel(of_trial, range(len(self.trials)), self.sizes)

    def _factors(self, index: int, moving: Sequence[int]) -> dict[int, list[int]]:
        """Map the nuisances of a trial that multiply only parameters in `moving` to the indices of these parameters."""
        named = {self.structure.names[j]: j for j in moving}
        return {
            k: [named[name] for name in parameter.factor_of]
            for k, parameter in enumerate(self.nuisances[index])
            if parameter.factor_of and all(name in named for name in parameter.factor_of)
        }

    def changes(
        self, index: int, here: tuple[np.ndarray, np.ndarray], moved: Sequence[tuple[Any, ...]], *, coarse: bool = False
    ) -> np.ndarray:
        """Changes of a trial's residuals, shape (len(moved), n), from `here` to nearby points (values, nuisances)."""
        predictions = self._simulate([here, *moved], index, coarse=coarse, alike=True)
        first, weight = self._apply_view(self._deviations(predictions[:1], index), index)
        with np.errstate(over="ignore", invalid="ignore"):  # handled below
            changes = self._samples(predictions[1:], index)
            changes -= self._samples(predictions[:1], index)
            changes *= self._weighing[index].weight
        reach = np.maximum(changes.max(axis=1, initial=0.0), -changes.min(axis=1, initial=0.0))
        away = np.flatnonzero(~(reach <= _MAX_DEVIATION))  # failed or diverging
        changes[away] = 0.0  # replaced below; infinities would enter the sums
        if self.view.blur:
            changes, _ = self._apply_view(changes, index)
        # the compression is linear over a step as small as a derivative's
        changes *= weight / self.view.raised / np.hypot(1.0, first[0] / self.view.raised / self.view.soft_limit)
        if len(away):
            seen = self._weigh([predictions[0], *(predictions[k + 1] for k in away)], index)
            changes[away] = seen[1:] - seen[0]
        return changes

    def fails(self, index: int, places: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
        """Mask, shape (n,), of the nearby `places` (values, nuisances) at which a trial cannot be predicted in full, or
        diverges."""
        samples, weighing = (
            self._samples(self._simulate(places, index, coarse=False, alike=True), index),
            self._weighing[index],
        )
        with np.errstate(over="ignore", invalid="ignore"):
            return ~(np.abs((samples - weighing.measured) * weighing.weight) <= _MAX_DEVIATION).all(axis=1)

    def scaled(self, predictions: Sequence[Channels]) -> list[Channels]:
        """(measured - predicted) / sd by trial and channel, neither compressed nor thinned; NaN where missing."""
        return [
            {c: (t.channels[c] - p[c]) / self.floor.sd(t, c) for c in t.channels}
            for t, p in zip(self.trials, predictions, strict=True)
        ]

    def slopes(self, point: Point) -> list[np.ndarray]:
        """Derivative of each residual with respect to its prediction, one vector per trial, shapes as `residuals`."""

        def slope(prediction: Channels, index: int) -> np.ndarray:
            weighing, deviations = self._weighing[index], self._deviations([prediction], index)[0]
            return weighing.weight * weighing.thinning / np.hypot(1.0, deviations / self.view.soft_limit)

        return self._of_each(point, slope)

    def _of_each(self, point: Point, finish: Callable[[Channels, int], Any], *, coarse: bool = False) -> list[Any]:
        """Simulate every trial and return `finish(prediction, index)` for each."""
        structure, theta = self.structure, self.structure.theta(point.values)
        learnt = structure.corrections(theta)
        found: list[Any] = [None] * len(self.trials)

        def together(members: Sequence[int]) -> None:
            thetas = [theta | self.named(i, point.nuisances[i]) for i in members]
            trials, corrections = [self.trials[i] for i in members], [learnt] * len(members)
            predictions = structure.system.predict_trials(
                thetas, structure.effects, trials, coarse=coarse, corrections=corrections
            )
            for i, prediction in zip(members, predictions, strict=True):
                found[i] = finish(prediction, i)

        in_parallel(together, self._together, [sum(self.sizes[i] for i in pack) for pack in self._together])
        return found

    def named(self, index: int, nuisances: np.ndarray) -> dict[str, float]:
        """Nuisances of a trial by name."""
        return {p.name: float(v) for p, v in zip(self.nuisances[index], nuisances, strict=True)}

    def _simulate(
        self, places: Sequence[tuple[np.ndarray, np.ndarray]], index: int, *, coarse: bool, alike: bool = False
    ) -> list[Channels]:
        """Channels of a trial at each of `places`: the structure's values and the trial's nuisances."""
        thetas = [self.structure.theta(values) for values, _ in places]
        corrections = [self.structure.corrections(theta) for theta in thetas]
        for theta, (_, nuisances) in zip(thetas, places, strict=True):
            theta |= self.named(index, nuisances)
        effects, trials = self.structure.effects, [self.trials[index]] * len(thetas)
        predict = self.structure.system.predict_trials
        return predict(thetas, effects, trials, coarse=coarse, corrections=corrections, alike=alike)

    def _weigh(self, predictions: Sequence[Channels], index: int) -> np.ndarray:
        """Residuals of a trial, a row for each prediction."""
        z, weight = self._apply_view(self._deviations(predictions, index), index)
        limit = self.view.soft_limit * self.view.raised
        return np.arcsinh(z / limit) * (self.view.soft_limit * weight)

    def _apply_view(self, z: np.ndarray, index: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the deviations, with blur low-pass filtered and decimated on an even grid, and their weights."""
        weight, ends = self._weighing[index].thinning, self._weighing[index].ends
        if not self.view.blur:
            return z, weight
        found, weights = [], []
        for z_, w_, grid in zip(np.split(z, ends, axis=1), np.split(weight, ends), self._grids[index], strict=True):
            shares, kept = _low_pass(z_.shape[1], self.view.blur)
            even, every, whole = z_ if grid is None else grid.of(z_), len(shares), len(kept)
            recent = even[:, : whole * every].reshape(len(even), whole, every) @ shares
            found.append(np.cumsum(recent / kept, axis=1) * kept)
            weights.append(w_[every - 1 :: every] * np.sqrt(every))
        return np.concatenate(found, axis=1), np.concatenate(weights)

    def _deviations(self, predictions: Sequence[Channels], index: int) -> np.ndarray:
        """Uncompressed residuals in standard deviations, a row for each prediction."""
        z = self._samples(predictions, index)
        with np.errstate(over="ignore"):  # diverging samples are clipped below
            z -= self._weighing[index].measured
            z *= self._weighing[index].weight
        z[~np.isfinite(z)] = FAILED
        return np.clip(z, -_MAX_DEVIATION, _MAX_DEVIATION, out=z)

    def _samples(self, predictions: Sequence[Channels], index: int) -> np.ndarray:
        """Predicted values of the measured samples, one channel after the other, a row for each prediction."""
        channels, keep = self.trials[index].channels, self._weighing[index].keep
        rows = np.empty((len(predictions), len(keep)))
        for row, prediction in zip(rows, predictions, strict=True):
            np.concatenate([prediction[c] for c in channels], out=row)
        return rows if keep.all() else rows[:, keep]


class _Weighing(NamedTuple):
    """Weights of a trial's samples, one channel after the other. `keep` marks those that were measured; for these: the
    values, 1 / standard deviation, 1 / sqrt(samples per piece), and where all channels but the last end."""

    keep: np.ndarray
    measured: np.ndarray
    weight: np.ndarray
    thinning: np.ndarray
    ends: np.ndarray

    @classmethod
    def of(cls, trial: Record, floor: NoiseFloor) -> _Weighing:
        channels = trial.channels
        measured = np.concatenate([*channels.values()])
        weight = np.concatenate([1.0 / floor.sd(trial, c) for c in channels])
        shares = [floor.of(trial.experiment, c).samples_per_piece ** -0.5 for c in channels]
        thinning = np.repeat(shares, [v.size for v in channels.values()])
        keep = np.isfinite(measured)
        ends = np.cumsum([np.isfinite(v).sum() for v in channels.values()])[:-1]
        return cls(keep, measured[keep], weight[keep], thinning[keep], ends)


@cache
def _low_pass(count: int, blur: float) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients of a low-pass filter that is evaluated once per block of samples: the contribution of each sample in
    a block to the filtered value at the block's end, and the decay from the first block's end to each block's end."""
    samples = count * blur
    decay, every = np.exp(-1.0 / max(samples, 1e-3)), max(1, round(samples / 4))
    return (1.0 - decay) * decay ** np.arange(every)[::-1], decay ** (every * np.arange(count // every))


def _span(samples: np.ndarray, sd: np.ndarray) -> float:
    """Largest magnitude of a channel's samples, at least that of the noise; infinite if nothing was measured."""
    return float(max(np.nanmax(np.abs(samples)), np.max(sd))) if np.isfinite(samples).any() else np.inf


def _pack_trials(trials: Sequence[Record], at_once: int) -> list[list[int]]:
    """Group the indices of trials that are simulated together: up to `at_once` of one experiment, unless too few."""
    experiments: dict[str, list[int]] = {}
    for i, trial in enumerate(trials):
        experiments.setdefault(trial.experiment, []).append(i)
    full = (members[k : k + at_once] for members in experiments.values() for k in range(0, len(members), at_once))
    return [part for pack in full for part in ([pack] if len(pack) >= _MIN_PACK_SIZE else [[i] for i in pack])]


def _stepped(values: np.ndarray, index: int, parameter: Parameter, step: float) -> tuple[np.ndarray, float]:
    """Move one entry of `values` by `step`; if that would cross its upper bound, towards the farther bound, no further
    than to it."""
    x, moved = values[index], values.copy()
    if x + step > parameter.upper:
        to = max(x - step, parameter.lower) if x - parameter.lower >= parameter.upper - x else parameter.upper
        step = to - x
        moved[index] = to
    else:
        moved[index] += step
    return moved, step


def _tuned(square_norm: np.ndarray, scales: np.ndarray) -> np.ndarray:
    ideal = 3.0 / np.sqrt(np.maximum(square_norm, 1e-300))
    return np.clip(ideal, SMALLEST_STEP * scales, LARGEST_STEP * scales)
