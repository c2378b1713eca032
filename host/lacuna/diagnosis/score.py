"""Screening: the score that ranks effects by how much of a fit's residual each could remove.

A Lagrange multiplier (score) test needs a derivative at the absent size, where an effect that clips or slips has none.
Here secants take its place: the changes of the weighted residual caused by the effect at each of its start sizes. What
the fit's own parameters and nuisances can reproduce is projected out, and effects are ranked by what the remaining
secant can remove when it is scaled by a factor between 0 and 3.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from lacuna.diagnosis.sizes import one_more
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.fit import Fit
from lacuna.estimation.problem import Point, Problem

_MAX_FACTOR = 3.0  # largest factor by which a secant is scaled: it is no guide beyond
_MIN_SHARE_LEFT = 0.02  # a change counts as absorbed if less than this share of its norm is left after projection


class Promise(NamedTuple):
    """A set of effects that may be fitted: its problem, the point from which the fit of a smaller set would continue
    with it, and the log-likelihood it promises to gain (0 until scored). `suspected`: fitted whatever the gain."""

    problem: Problem
    start: Point
    gain: float = 0.0
    suspected: bool = False

    @property
    def effect(self) -> str:
        """The effect that was added last."""
        return self.problem.structure.effects[-1]


@dataclass(frozen=True)
class Screened:
    """What the data could reveal about an effect.

    `visible`: the largest change of the residual over the sizes tried, in standard deviations, after projecting out
    what the base can imitate; `absorbed`: whether hardly anything is left of it at any size. `gain`: log-likelihood to
    first order. `wrong_sign`: the share of the residual it would remove if its bounds allowed the opposite sign.
    """

    effect: str
    visible: float
    absorbed: bool
    gain: float
    wrong_sign: float = 0.0

    @property
    def detectable(self) -> bool:
        return self.visible > 5.0 and not self.absorbed


@dataclass(frozen=True)
class Scores:
    """The scores of all secants (one added effect at one of its sizes), arrays of shape (m,). `whole`: the norm of the
    change of the residual; `squares`: the squared norm of that change after projecting out the parent's parameters and
    nuisances; `push`: the inner product of the projected change with the parent's projected residual, negative if the
    effect reduces it. `square`: the squared norm of that residual."""

    secants: tuple[Promise, ...]
    whole: np.ndarray
    squares: np.ndarray
    push: np.ndarray
    square: float

    @cached_property
    def _seen(self) -> np.ndarray:
        """Which secants are not absorbed; what is left of the others is only their nonlinearity."""
        return np.sqrt(self.squares) > _MIN_SHARE_LEFT * self.whole

    @cached_property
    def gains(self) -> np.ndarray:
        """Log-likelihood that each secant would gain at its best scale factor."""
        far = np.where(self._seen, np.clip(-self.push / self.squares, 0.0, _MAX_FACTOR), 0.0)
        return -(far * self.push + 0.5 * far**2 * self.squares)

    def singles(self) -> list[Promise]:
        """Each effect at its best size, most promising first."""
        best: dict[str, int] = {}
        for k, secant in enumerate(self.secants):
            if secant.effect not in best or self.gains[k] > self.gains[best[secant.effect]]:
                best[secant.effect] = k
        found = [self.secants[k]._replace(gain=float(self.gains[k])) for k in best.values()]
        return sorted(found, key=lambda one: -one.gain)

    def screened(self) -> tuple[Screened, ...]:
        """What the data could reveal about each effect."""
        found, left = [], np.sqrt(self.squares)
        for name in dict.fromkeys(secant.effect for secant in self.secants):
            mine = np.array([k for k, secant in enumerate(self.secants) if secant.effect == name])
            absorbed = not self._seen[mine].any()
            least = mine[0]  # the smallest size is closest to a derivative
            away = max(self.push[least], 0.0) ** 2 / (self.squares[least] * max(self.square, 1e-300))
            found.append(Screened(name, float(left[mine].max()), absorbed, float(self.gains[mine].max()), float(away)))
        return tuple(found)


def score(parent: Fit, effects: Sequence[str], workers: Workers) -> Scores:
    """Score how much of the residual of `parent` each of `effects` could remove, at each of its start sizes."""
    basis, remaining = remaining_after(parent)
    reference = np.concatenate(parent.problem.residuals(parent.solution.point))
    jobs = [one_more(parent, effect) for effect in effects]
    moved = workers.map("scoring", [problem.structure.effects for problem, *_ in jobs], _moved, jobs)
    secants = tuple(Promise(job[0], start) for job, (begun, _) in zip(jobs, moved, strict=True) for start in begun)
    changes = np.array([row - reference for _, rows in moved for row in rows]).reshape(len(secants), len(reference)).T
    left = changes - basis @ (basis.T @ changes)
    return Scores(
        secants,
        np.linalg.norm(changes, axis=0),
        np.maximum(np.square(left).sum(axis=0), 1e-12),
        left.T @ remaining,
        float(remaining @ remaining),
    )


def _moved(
    problem: Problem, sizes: Sequence[np.ndarray], nuisances: Sequence[np.ndarray]
) -> tuple[list[Point], list[np.ndarray]]:
    """The starting point of a fit for each size, and the residuals there."""
    begun = [problem.start(values, nuisances) for values in sizes]
    return begun, [np.concatenate(problem.residuals(start)) for start in begun]


def remaining_after(fitted: Fit) -> tuple[np.ndarray, np.ndarray]:
    """An orthonormal basis, shape (n, q), of the changes that the fit's parameters and nuisances can make to the
    residuals, and the residuals, shape (n,), with their projection on it removed."""
    problem, point = fitted.problem, fitted.solution.point
    every = range(len(fitted.structure.names))
    taken = fitted.solution.sensitivities or problem.jacobians(point, every, problem.first_steps())
    by_structure, by_nuisances = zip(*(one.dense() for one in taken), strict=True)
    basis = _orthonormal(np.hstack([np.vstack(by_structure), block_diag(*by_nuisances)]))
    residual = np.concatenate(problem.residuals(point))
    return basis, residual - basis @ (basis.T @ residual)


def _orthonormal(matrix: np.ndarray) -> np.ndarray:
    norms = np.linalg.norm(matrix, axis=0)
    kept = matrix[:, norms > 0] / norms[norms > 0]
    if kept.shape[1] == 0:
        return np.zeros((matrix.shape[0], 0))
    # from the Gram matrix, since there are few columns and many rows
    values, vectors = np.linalg.eigh(kept.T @ kept)
    good = values > 1e-10 * values[-1]
    return kept @ (vectors[:, good] / np.sqrt(values[good]))
