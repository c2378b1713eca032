"""Derivatives of one trial's residuals, corrected after every step that is taken (Broyden 1965)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of n residuals with respect to p parameters of the structure and the trial's own q nuisances.

    `differences`, shape (m, n), holds the finite differences, a row for each of those of the p + q parameters that the
    residuals depend on, listed in `active`; a trial that isolates parameters depends on few of them. The corrections of
    the k steps since are added as the product of `left`, shape (k, n), and `right`, shape (k, p + q). `gram`, shape
    (p + q, p + q), is the Gram matrix of the sum, kept up to date because n is large. `structure` is p.
    """

    differences: np.ndarray
    active: np.ndarray
    gram: np.ndarray
    left: np.ndarray
    right: np.ndarray
    structure: int

    @classmethod
    def of(cls, differences: np.ndarray, active: ArrayLike, structure: int, nuisances: int) -> Sensitivity:
        """Derivatives from finite differences, without corrections."""
        size, active = structure + nuisances, np.asarray(active, int)
        gram = np.zeros((size, size))
        gram[np.ix_(active, active)] = differences @ differences.T
        return cls(differences, active, gram, np.zeros((0, differences.shape[1])), np.zeros((0, size)), structure)

    def gradient(self, residuals: np.ndarray) -> np.ndarray:
        """Transposed derivatives times `residuals`: the gradient of half their sum of squares, shape (p + q,)."""
        found = (self.left @ residuals) @ self.right
        found[self.active] += self.differences @ residuals
        return found

    def times(self, step: np.ndarray) -> np.ndarray:
        """Predicted change of the residuals by a step, shape (n,)."""
        return step[self.active] @ self.differences + (self.right @ step) @ self.left

    def corrected(self, step: np.ndarray, scale: np.ndarray, change: np.ndarray) -> Sensitivity:
        """Return the derivatives with the smallest correction, in units of `scale`, that makes them reproduce the
        observed `change` (Broyden's update). Parameters that the residuals do not depend on stay without effect."""
        active = np.where(np.diag(self.gram) > 0.0, step / scale**2, 0.0)
        length = float(active @ step)
        if length == 0.0:
            return self
        missed = (change - self.times(step)) / length
        cross = np.outer(self.gradient(missed), active)
        gram = self.gram + cross + cross.T + float(missed @ missed) * np.outer(active, active)
        return replace(self, gram=gram, left=np.vstack([self.left, missed]), right=np.vstack([self.right, active]))

    def reweighed(self, factors: np.ndarray) -> Sensitivity:
        """Multiply the derivatives of every residual by its own factor; `factors` has shape (n,)."""
        return self.of(self._rows * factors, self.active, self.structure, len(self.gram) - self.structure)

    def dense(self) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives with respect to the structure's parameters, shape (n, p), and the nuisances, shape (n, q)."""
        whole = np.zeros((self.gram.shape[0], self.differences.shape[1]))
        whole[self.active] = self._rows
        return whole[: self.structure].T, whole[self.structure :].T

    @property
    def _rows(self) -> np.ndarray:
        """`differences` with the corrections of the steps since."""
        return self.differences + self.right[:, self.active].T @ self.left if len(self.left) else self.differences
