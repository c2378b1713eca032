"""Fit a structure to trials from several starts with equal effort, and count how many of them agree."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lacuna.estimation.graduated import solve_graduated
from lacuna.estimation.noise import MAX_REESTIMATES, REFIT_SHARE, NoiseFloor, estimate_noise
from lacuna.estimation.problem import PLAIN, SOFT_LIMIT, Point, Problem
from lacuna.estimation.solve import MIN_GAIN, REL_TOL, Solution, cost_of, solve
from lacuna.estimation.structure import Structure
from lacuna.system import Channels, Record, System

_MAX_REWEIGH_ITERATIONS = 40  # iterations with another floor


_UNDETERMINED_SD = 0.1  # scales: tolerance of a bound for a parameter that the data do not determine
_MIN_REL_GAIN = 1e-3  # of the cost: a search that gains less is not followed by another
_CONVERGED = 4e-3  # the same for a reported RMS error, which is then known to a fifth of a per cent
_CONVERGED_ITERATIONS, _ROUNDS = 20, 5
_NUISANCE_ITERATIONS = 20  # of a record's own nuisances, which are few: their derivatives cost little
_NO_NUISANCES = np.zeros(0)


@dataclass(frozen=True)
class Fit:
    """A structure fitted to trials."""

    problem: Problem
    solution: Solution

    @property
    def structure(self) -> Structure:
        return self.problem.structure

    @property
    def theta(self) -> dict[str, float]:
        return self.structure.theta(self.solution.point.values)

    @property
    def cost(self) -> float:
        return self.solution.cost

    @cached_property
    def known_nuisances(self) -> dict[str, np.ndarray]:
        """Cached nuisances of trials that the fit was evaluated on (`evaluate_on`), by trial name."""
        return {}

    @property
    def at_bound(self) -> np.ndarray:
        """Whether a bound stopped each free parameter, shape (P,). A search seldom ends exactly on a bound, so the test
        is whether the parameter could reach it, the others refitted, at a cost below the search's tolerance."""
        free = list(self.solution.free)
        values, scales = self.solution.point.values, self.structure.scales()[free]
        normal = self.solution.normal * np.outer(scales, scales)
        known = np.eye(len(free)) / _UNDETERMINED_SD**2  # decides for a parameter that the data leave open
        covariance = np.linalg.inv(normal + known) * np.outer(scales, scales)
        variance = np.diag(covariance)
        from_below = variance.copy()
        for index, floor in self.structure.ordered:
            if index in free and floor in free and values[floor] > self.structure.parameters[index].lower:
                i, j = free.index(index), free.index(floor)
                from_below[i] = variance[i] + variance[j] - 2.0 * covariance[i, j]
        lower, upper = (bound[free] for bound in self.structure.bounds(values))
        below, above = values[free] - lower, upper - values[free]
        return (below**2 <= 2.0 * MIN_GAIN * from_below) | (above**2 <= 2.0 * MIN_GAIN * variance)

    def predictions(self) -> list[Channels]:
        """Predictions of every fitted trial."""
        return self.problem.predict_all(self.solution.point)

    def residuals(self) -> dict[str, Channels]:
        """Measured minus predicted by trial name and channel, in the channels' units."""
        return {
            t.name: {c: t.channels[c] - p[c] for c in t.channels}
            for t, p in zip(self.problem.trials, self.predictions(), strict=True)
        }

    def scaled_residuals(self) -> list[Channels]:
        """Measured minus predicted in standard deviations of the floor, one mapping per trial."""
        return self.problem.scaled(self.predictions())


def rms_by_channel(trials: Sequence[Record], residuals: Iterable[Channels]) -> dict[tuple[str, str], float]:
    """RMS of the `residuals` of these trials that exist, by (experiment, channel), every trial weighted equally."""
    squares: dict[tuple[str, str], list[float]] = {}
    for trial, channels in zip(trials, residuals, strict=True):
        for channel, residual in channels.items():
            if (known := residual[np.isfinite(residual)]).size:
                squares.setdefault((trial.experiment, channel), []).append(float(np.mean(known**2)))
    return {key: float(np.sqrt(np.mean(values))) for key, values in squares.items()}


def fit(
    structure: Structure,
    trials: Sequence[Record],
    floor: NoiseFloor,
    *,
    starts: Sequence[np.ndarray] = (),
    max_iterations: int = 20,
    relative: float = REL_TOL,
    graduated: bool = False,
) -> Fit:
    """Fit `structure` from each of `starts` (vectors; default: its own start), and keep the best."""
    problem = Problem(structure, trials, floor)
    options: dict[str, Any] = {"max_iterations": max_iterations, "relative": relative}
    solutions = [
        solve_graduated(problem, values, **options) if graduated else solve(problem, problem.start(values), **options)
        for values in list(starts) or [structure.start()]
    ]
    return Fit(problem, min(solutions, key=lambda s: s.cost))


def refit_on(
    fitted: Fit, trials: Sequence[Record], *, near: Sequence[Fit], max_iterations: int = 20, relative: float = REL_TOL
) -> Fit:
    """Refit to other trials from the fitted values. `near`: fits that together have these trials' nuisances."""
    problem = fitted.problem.over(trials)
    known = {name: nuisances for one in near for name, nuisances in _by_name(one).items()}
    start = Point(fitted.solution.point.values, tuple(known[t.name] for t in trials))
    options: dict[str, Any] = {"max_iterations": max_iterations, "relative": relative}
    return Fit(problem, continue_search(problem, solve(problem, start, **options), restart_nuisances=False, **options))


def converged(fitted: Fit) -> Fit:
    """Continue the fit by plain least squares to convergence, the state for which an RMS error is reported. Searches
    follow one another, each with fresh derivatives, until one gains less than `_CONVERGED` of the cost."""
    problem = fitted.problem.seen(PLAIN)
    options: dict[str, Any] = {"max_iterations": _CONVERGED_ITERATIONS, "relative": 0.3 * _MIN_REL_GAIN}
    solution = solve(problem, fitted.solution.point, **options)
    if not fitted.structure.sites:  # curves have many parameters, and their fits are not compared with others
        solution = continue_search(problem, solution, min_gain=_CONVERGED, **options)
    return Fit(problem, solution)


def continue_search(
    problem: Problem,
    solution: Solution,
    *,
    min_gain: float = _MIN_REL_GAIN,
    restart_nuisances: bool = True,
    **options: Any,
) -> Solution:
    """Continue from `solution` with further searches for as long as one gains the share `min_gain` of the cost. Each
    round searches on with the nuisances as they are, unless that has converged, and (`restart_nuisances`) while that
    helps, also with the nuisances restarted at their means: if the model predicts a jump slightly early or late, a
    nuisance and a parameter of similar effect (a run's friction and the friction) hold each other in place until a
    search releases one."""
    restart_nuisances = restart_nuisances and any(problem.nuisances)
    for _ in range(_ROUNDS):
        further = [] if solution.converged else [solve(problem, solution.point, **options)]
        if restart_nuisances:
            from_means = solve(problem, problem.start(solution.point.values), **options)
            restart_nuisances = from_means.cost < min((s.cost for s in further), default=solution.cost)
            further.append(from_means)
        best = min(further, key=lambda s: s.cost, default=solution)
        gained = solution.cost - best.cost
        solution = min(solution, best, key=lambda s: s.cost)
        if gained < min_gain * solution.cost:
            break
    return solution


def refit_at_misfit(fitted: Fit) -> Fit:
    """Refit with the floor of a channel raised to the RMS residual that the fit leaves there, if that exceeds
    `SOFT_LIMIT`: all samples of the channel are then badly predicted, and none should be discounted as an outlier."""
    squares: dict[tuple[str, str], list[np.ndarray]] = {}
    for trial, channels in zip(fitted.problem.trials, fitted.scaled_residuals(), strict=True):
        for channel, z in channels.items():
            squares.setdefault((trial.experiment, channel), []).append(np.square(z[np.isfinite(z)]))
    left = {key: float(np.sqrt(np.mean(np.concatenate(each)))) for key, each in squares.items()}
    floor = fitted.problem.floor.raised({key: rms for key, rms in left.items() if rms > SOFT_LIMIT})
    return fitted if floor == fitted.problem.floor else reweigh(fitted, floor, max_iterations=_MAX_REWEIGH_ITERATIONS)


def relax_priors(fitted: Fit) -> Fit:
    """Return the fit, its parameters unchanged, with relaxed priors on those with `Parameter.prior_from_trials`."""
    problem = fitted.problem.with_prior(relax_priors=True)
    return Fit(problem, replace(fitted.solution, cost=cost_of(problem, fitted.solution.point)))


def predictive(fitted: Fit) -> Fit:
    """Return the fit with each run's `Parameter.factor_of` factors at their means, as they are before the run."""
    problem, point = fitted.problem, fitted.solution.point
    if not any(p.factor_of for parameters in problem.nuisances for p in parameters):
        return fitted
    expected = tuple(
        np.array([p.value if p.factor_of else value for value, p in zip(values, parameters, strict=True)])
        for values, parameters in zip(point.nuisances, problem.nuisances, strict=True)
    )
    point = replace(point, nuisances=expected)
    return Fit(problem, replace(fitted.solution, point=point, cost=cost_of(problem, point)))


def reweigh(fitted: Fit, floor: NoiseFloor, *, max_iterations: int) -> Fit:
    """Refit the same structure and trials against another floor, by a few steps with the existing derivatives. With
    `max_iterations` 0 only the cost is recomputed, and the result has no derivatives."""
    point = fitted.solution.point
    problem = fitted.problem.over(fitted.problem.trials, floor)
    sensitivities = fitted.solution.sensitivities
    if not max_iterations:
        bare = replace(fitted.solution, cost=cost_of(problem, point), normal=np.zeros((0, 0)), sensitivities=())
        return Fit(problem, bare)
    known = None  # derivatives are recomputed
    if sensitivities:
        pairs = zip(problem.slopes(point), fitted.problem.slopes(point), strict=True)
        known = [s.reweighed(new / old) for s, (new, old) in zip(sensitivities, pairs, strict=True)]
    return Fit(problem, solve(problem, point, max_iterations=max_iterations, sensitivities=known))


def evaluate_on(fitted: Fit, trials: Sequence[Record], *, near: Fit | None = None) -> Fit:
    """Evaluate the fitted parameters on other trials, estimating only these trials' nuisances, from those in `near` if
    it has them, once per fit. The prior cost of the parameters is not counted again."""
    known, values = fitted.known_nuisances, fitted.solution.point.values
    unknown = fitted.problem.over([t for t in trials if t.name not in known])
    if any(unknown.nuisances):
        initial = _by_name(near) if near else {}
        point = unknown.start(values, [initial.get(t.name, _NO_NUISANCES) for t in unknown.trials])
        # a run's nuisance may be far from its mean; only plain least squares converges from there
        far = any(t.name not in initial for t in unknown.trials)
        for view in dict.fromkeys((PLAIN, unknown.view) if far else (unknown.view,)):
            found = solve(unknown.seen(view), point, free=(), max_iterations=_NUISANCE_ITERATIONS)
            point = found.point
        known |= _by_name(Fit(unknown, found))
    # if all trials were just estimated, their residuals are still cached
    problem = unknown if len(unknown.trials) == len(trials) else fitted.problem.over(trials)
    point = Point(values, tuple(known.get(t.name, _NO_NUISANCES) for t in problem.trials))
    cost = cost_of(problem, point) - problem.structure_prior_cost(point)
    return Fit(problem, Solution(point, cost, True, (), np.zeros((0, 0)), ()))


def _by_name(fitted: Fit) -> dict[str, np.ndarray]:
    """Nuisances of each trial by its name."""
    return dict(zip((t.name for t in fitted.problem.trials), fitted.solution.point.nuisances, strict=True))


def spread_starts(structure: Structure, around: np.ndarray, count: int, seed: int) -> list[np.ndarray]:
    """Return `around` and count - 1 random vectors within the bounds; deterministic for a given `seed`. A parameter is
    drawn uniformly from its plausible range, else from its prior, else within a few scales of `around`; the size of an
    effect from the range of its start sizes, with either sign if the bounds allow it."""
    draw = np.random.default_rng(seed)
    return [around, *(_random_start(structure, around, draw) for _ in range(count - 1))]


def _random_start(structure: Structure, around: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    values = around + 2 * structure.scales() * draw.standard_normal(len(around))
    for index, parameter in enumerate(structure.parameters):
        if parameter.plausible is not None:
            values[index] = draw.uniform(*parameter.plausible)
        elif parameter.prior_sd is not None:
            values[index] = parameter.value + parameter.prior_sd * draw.standard_normal()
    for effect in (structure.system.effects[name] for name in structure.effects):
        for name, parameter in zip(effect.size_names, effect.parameters, strict=False):
            factor = draw.uniform(min(effect.start_factors), max(effect.start_factors))
            sign = draw.choice((-1.0, 1.0)) if parameter.lower < effect.absent < parameter.upper else 1.0
            size = effect.absent + sign * factor * (parameter.value - effect.absent)
            values[structure.names.index(name)] = size
    lower, upper = structure.bounds(values)
    return structure.raise_to_limits(np.clip(values, lower, upper))


def fit_base(system: System, trials: Sequence[Record]) -> Fit:
    """Fit the base model, then re-estimate the noise floor from the differences between repeats' residuals and refit,
    for as long as the floor falls: the first floor includes whatever else differs between runs."""
    floor = estimate_noise(system, trials)
    found = fit(Structure(system), trials, floor, max_iterations=30, graduated=True)
    for _ in range(MAX_REESTIMATES):
        sharper = floor.lowered_by(estimate_noise(system, trials, found.residuals()))
        fallen, floor = sharper.share_of(floor), sharper
        found = reweigh(found, floor, max_iterations=10)
        if fallen >= REFIT_SHARE:
            break
    return found
