"""Does a parameter drift over the session? Consecutive repeats hide it; the order of the trials reveals it."""

from collections import defaultdict
from typing import NamedTuple

import numpy as np

from lacuna.diagnosis.policy import POLICY, Policy
from lacuna.estimation.fit import Fit
from lacuna.estimation.uncertainty import pieces_of

_SHUFFLES = 2000
_MIN_TRIALS = 6  # ordered trials, and how many of equal weight would inform a parameter as well


class Drift(NamedTuple):
    """A base parameter that changes with the order of the session. `share`: what its drift adds to the mean square
    residual, in units of the floor's variance, in the experiment where it adds most."""

    parameter: str
    share: float

    def matters(self, policy: Policy) -> bool:
        return self.share > policy.relevance


def find_drift(fitted: Fit, *, policy: Policy = POLICY, seed: int = 0) -> tuple[Drift, ...]:
    """Find base parameters whose value, estimated from single trials, changes with `session_order`. Projecting each
    trial's residual on the derivative with respect to a parameter gives the shift that this trial alone would favour,
    weighted by its precision and by the scatter between trials (DerSimonian and Laird 1986). Its correlation with the
    order is compared with that of shuffled orders, over all parameters at once."""
    trials = fitted.problem.trials
    places = {k: t.session_order for k, t in enumerate(trials) if t.session_order is not None}
    ordered = list(places)
    if len(ordered) < _MIN_TRIALS or not fitted.solution.sensitivities:
        return ()
    order = np.array([float(place) for place in places.values()])
    columns, trial_shifts, weights = _shifts_by_trial(fitted, ordered)
    if not columns:
        return ()
    observed = _trend(trial_shifts, weights, order)
    draw = np.random.default_rng(seed)
    largest = [_trend(trial_shifts, weights, draw.permutation(order)).max() for _ in range(_SHUFFLES)]
    limit = np.quantile(largest, 1 - policy.drift_chance)
    return tuple(
        Drift(fitted.structure.names[fitted.solution.free[columns[k]]], _added(fitted, ordered, columns[k], moved))
        for k, moved in enumerate(_moved(trial_shifts, weights, order))
        if observed[k] > limit
    )


def _moved(trial_shifts: np.ndarray, weights: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Each parameter's shift in each trial, from a weighted straight-line fit to the trials' shifts, shape (P, n)."""
    place = order - (weights @ order / weights.sum(axis=1))[:, None]
    slope = (weights * trial_shifts * place).sum(axis=1) / np.maximum((weights * place**2).sum(axis=1), 1e-300)
    return slope[:, None] * place


def _added(fitted: Fit, ordered: list[int], column: int, moved: np.ndarray) -> float:
    """What such shifts add to the mean square residual where they add most, beyond the declared accuracy."""
    squares: dict[str, float] = defaultdict(float)
    pieces: dict[str, float] = defaultdict(float)
    by_channel: dict[tuple[str, str], list[float]] = defaultdict(lambda: [0.0, 0.0])
    jacobians, floor = fitted.solution.jacobians, fitted.problem.floor
    for k, shift in zip(ordered, moved, strict=True):
        trial, derivative = fitted.problem.trials[k], jacobians[k][0][:, column]
        squares[trial.experiment] += float(derivative @ derivative) * shift**2
        pieces[trial.experiment] += pieces_of(trial, floor)
        known = [np.isfinite(values).sum() for values in trial.channels.values()]
        for channel, part in zip(trial.channels, np.split(derivative, np.cumsum(known)[:-1]), strict=True):
            of_channel = by_channel[trial.experiment, channel]
            of_channel[0] += float(part @ part) * shift**2
            of_channel[1] += len(part) / floor.of(trial.experiment, channel).samples_per_piece
    for (experiment, channel), (square, count) in by_channel.items():
        enough = (fitted.structure.system.accuracy(experiment, channel) / floor.of(experiment, channel).sd) ** 2
        if square <= enough * count:
            squares[experiment] -= square
    return max(squares[e] / pieces[e] for e in squares)


def _shifts_by_trial(fitted: Fit, ordered: list[int]) -> tuple[list[int], np.ndarray, np.ndarray]:
    """Columns of the parameters that enough trials inform, with each trial's shift and its weight, shapes (P, n)."""
    residuals, jacobians = fitted.problem.residuals(fitted.solution.point), fitted.solution.jacobians
    columns, trial_shifts, weights = [], [], []
    for column, index in enumerate(fitted.solution.free):
        if index >= len(fitted.structure.system.parameters):
            continue
        pairs = [(jacobians[k][0][:, column], residuals[k]) for k in ordered]
        known = np.array([float(d @ d) for d, _ in pairs])
        pulls = np.array([-float(d @ r) for d, r in pairs])
        shifts = np.divide(pulls, known, out=np.zeros_like(pulls), where=known > 0)
        weight = _weights(shifts, known)
        square = float(weight @ weight)
        if square > 0.0 and float(weight.sum()) ** 2 / square >= _MIN_TRIALS:
            columns.append(column)
            trial_shifts.append(shifts)
            weights.append(weight)
    return columns, np.array(trial_shifts), np.array(weights)


def _weights(shifts: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Inverse variance of each shift: its estimation error plus the scatter between trials beyond that error."""
    total, count = known.sum(), np.count_nonzero(known)
    if count < 2:
        return known
    excess = float(known @ (shifts - known @ shifts / total) ** 2) - (count - 1)
    between = max(excess, 0.0) / max(total - float(known @ known) / total, 1e-300)
    return known / (1.0 + between * known)


def _trend(trial_shifts: np.ndarray, weights: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Weighted correlation of each parameter's shifts with the order, as a z-score (Fisher's transform), shape (P,)."""
    total = weights.sum(axis=1)
    shift = trial_shifts - ((weights * trial_shifts).sum(axis=1) / total)[:, None]
    place = order - ((weights @ order) / total)[:, None]
    both, squares, spread = ((weights * product).sum(axis=1) for product in (shift * place, shift**2, place**2))
    correlation = np.abs(both) / np.sqrt(np.maximum(squares * spread, 1e-300))
    effective = total**2 / (weights**2).sum(axis=1)
    return np.arctanh(np.minimum(correlation, 1.0 - 1e-9)) * np.sqrt(effective - 3.0)
