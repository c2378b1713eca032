"""What an effect could take away from the residual of a fit: the score that ranks everything that may be tried.

A Lagrange multiplier test asks for a derivative at the absent size, where an effect that clips or slips has none. Here
a secant stands in its place: the change of the weighted residual by the effect at each of the sizes that fits begin at.
What the fit's own parameters and nuisances can do is projected off, and by what remains of it an effect is ranked,
a secant as much as three times as long, none the other way round.
"""

from __future__ import annotations

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

_LONGEST = 3.0  # times a secant, that it is followed: further it says nothing
_ABSORBED = 0.02  # a change in the residual of which less than this share is left after the parent's is absorbed


class Promise(NamedTuple):
    """A set of effects, where a smaller set would go on with it, and the log-likelihood that it promises to gain, once
    that is known; `suspected`: it is fitted whatever that is."""

    problem: Problem
    start: Point
    gain: float = 0.0
    suspected: bool = False

    @property
    def effect(self) -> str:
        """The one that joins the others."""
        return self.problem.structure.effects[-1]


@dataclass(frozen=True)
class Screened:
    """What the data could tell of an effect of typical size.

    `visible`: standard deviations that it stands out by at the largest size tried after everything that the base can
    imitate is taken off; `absorbed` if hardly anything is left of it at any size. `gain`: log-likelihood to first
    order. `wrong_sign`: the share of the residual that it would remove if its bounds allowed the other sign.
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
    """Of every secant (an effect more at one of its sizes), shapes (m,): `whole`, the norm of what it changes the
    residual by; of what is left of that after the parent's own parameters the `squares`, and `push`, its product with
    what the parent leaves, negative where it takes away from it. `square`: of what the parent leaves."""

    secants: tuple[Promise, ...]
    whole: np.ndarray
    squares: np.ndarray
    push: np.ndarray
    square: float

    @cached_property
    def _seen(self) -> np.ndarray:
        """Of which secants enough is left to say anything: of others it is what a straight line misses."""
        return np.sqrt(self.squares) > _ABSORBED * self.whole

    @cached_property
    def gains(self) -> np.ndarray:
        """Log-likelihood that each secant would gain, as far as it is followed."""
        far = np.where(self._seen, np.clip(-self.push / self.squares, 0.0, _LONGEST), 0.0)
        return -(far * self.push + 0.5 * far**2 * self.squares)

    def singles(self) -> list[Promise]:
        """Each effect at its best size, the most promising first."""
        best: dict[str, int] = {}
        for k, secant in enumerate(self.secants):
            if secant.effect not in best or self.gains[k] > self.gains[best[secant.effect]]:
                best[secant.effect] = k
        found = [self.secants[k]._replace(gain=float(self.gains[k])) for k in best.values()]
        return sorted(found, key=lambda one: -one.gain)

    def screened(self) -> tuple[Screened, ...]:
        """What the data could tell of each effect."""
        found, left = [], np.sqrt(self.squares)
        for name in dict.fromkeys(secant.effect for secant in self.secants):
            mine = np.array([k for k, secant in enumerate(self.secants) if secant.effect == name])
            absorbed = not self._seen[mine].any()
            least = mine[0]  # the smallest size tells of a derivative
            away = max(self.push[least], 0.0) ** 2 / (self.squares[least] * max(self.square, 1e-300))
            found.append(Screened(name, float(left[mine].max()), absorbed, float(self.gains[mine].max()), float(away)))
        return tuple(found)


def score(parent: Fit, effects: Sequence[str], workers: Workers) -> Scores:
    """What each of `effects` could take away from what `parent` leaves, at each of its sizes."""
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
    """Where a fit would begin at each size, and the residuals there."""
    begun = [problem.start(values, nuisances) for values in sizes]
    return begun, [np.concatenate(problem.residuals(start)) for start in begun]


def remaining_after(fitted: Fit) -> tuple[np.ndarray, np.ndarray]:
    """An orthonormal basis, (n, q), of what the fit's parameters and nuisances can move the residuals by, and the
    residuals, (n,), less that."""
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
    # by the Gram matrix: the columns are few and the rows many
    values, vectors = np.linalg.eigh(kept.T @ kept)
    good = values > 1e-10 * values[-1]
    return kept @ (vectors[:, good] / np.sqrt(values[good]))
