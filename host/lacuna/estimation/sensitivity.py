"""Derivatives of one trial's residuals, which learn from every step that is taken (Broyden 1965)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of n residuals by p parameters of the structure and the trial's own q nuisances.

    `taken`, shape (m, n), as finite differences gave them, a row for each of the parameters, of all p + q, that are
    `felt`: a trial that isolates parameters feels few of them. To them are added the products of `left` (k, n) and
    `right` (k, p + q) of the steps since. `gram`, shape (p + q, p + q), is of the sum: kept up to date, since the
    residuals are many.
    """

    taken: np.ndarray
    felt: np.ndarray
    gram: np.ndarray
    left: np.ndarray
    right: np.ndarray
    structure: int

    @property
    def nuisances(self) -> int:
        return self.gram.shape[0] - self.structure

    @classmethod
    def of(cls, taken: np.ndarray, felt: ArrayLike, structure: int, nuisances: int) -> Sensitivity:
        size, felt = structure + nuisances, np.asarray(felt, int)
        gram = np.zeros((size, size))
        gram[np.ix_(felt, felt)] = taken @ taken.T
        return cls(taken, felt, gram, np.zeros((0, taken.shape[1])), np.zeros((0, size)), structure)

    def gradient(self, residuals: np.ndarray) -> np.ndarray:
        """Transposed derivatives times `residuals`, shape (p + q,)."""
        found = (self.left @ residuals) @ self.right
        found[self.felt] += self.taken @ residuals
        return found

    def times(self, step: np.ndarray) -> np.ndarray:
        """What the residuals should change by, shape (n,)."""
        return step[self.felt] @ self.taken + (self.right @ step) @ self.left

    def corrected(self, step: np.ndarray, scale: np.ndarray, change: np.ndarray) -> Sensitivity:
        """The least change, counted in scales, by which the derivatives say what the step did. A parameter that the
        residuals do not feel stays without effect."""
        felt = np.where(np.diag(self.gram) > 0.0, step / scale**2, 0.0)
        length = float(felt @ step)
        if length == 0.0:
            return self
        missed = (change - self.times(step)) / length
        cross = np.outer(self.gradient(missed), felt)
        gram = self.gram + cross + cross.T + float(missed @ missed) * np.outer(felt, felt)
        return replace(self, gram=gram, left=np.vstack([self.left, missed]), right=np.vstack([self.right, felt]))

    def reweighed(self, factors: np.ndarray) -> Sensitivity:
        """With every residual's derivatives times its own factor, shape (n,)."""
        return self.of(self._rows * factors, self.felt, self.structure, self.nuisances)

    def dense(self) -> tuple[np.ndarray, np.ndarray]:
        """By the structure's parameters, shape (n, p), and by the nuisances, shape (n, q)."""
        whole = np.zeros((self.gram.shape[0], self.taken.shape[1]))
        whole[self.felt] = self._rows
        return whole[: self.structure].T, whole[self.structure :].T

    @property
    def _rows(self) -> np.ndarray:
        """`taken` with what the steps since have taught."""
        return self.taken + self.right[:, self.felt].T @ self.left if len(self.left) else self.taken
