"""Derivatives of one trial's residuals, which learn from every step that is taken (Broyden 1965)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of n residuals by p parameters of the structure and the trial's own q nuisances.

    `taken`, shape (p + q, n), as finite differences gave them, a parameter a row; to them are added the products of
    `left` (m, n) and `right` (m, p + q) of the steps since. `gram`, shape (p + q, p + q), is of the sum: kept up to
    date, since the residuals are many.
    """

    taken: np.ndarray
    gram: np.ndarray
    left: np.ndarray
    right: np.ndarray
    structure: int

    @property
    def nuisances(self) -> int:
        return self.gram.shape[0] - self.structure

    @classmethod
    def of(cls, by_structure: np.ndarray, by_nuisances: np.ndarray) -> Sensitivity:
        taken = np.concatenate([by_structure.T, by_nuisances.T])
        size, n = taken.shape
        felt = np.flatnonzero(taken.any(axis=1))  # a trial that isolates parameters feels few of them
        gram, rows = np.zeros((size, size)), taken[felt]
        gram[np.ix_(felt, felt)] = rows @ rows.T
        return cls(taken, gram, np.zeros((0, n)), np.zeros((0, size)), by_structure.shape[1])

    def gradient(self, residuals: np.ndarray) -> np.ndarray:
        """Transposed derivatives times `residuals`, shape (p + q,)."""
        return self.taken @ residuals + (self.left @ residuals) @ self.right

    def times(self, step: np.ndarray) -> np.ndarray:
        """What the residuals should change by, shape (n,)."""
        return step @ self.taken + (self.right @ step) @ self.left

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
        return Sensitivity(
            self.taken, gram, np.vstack([self.left, missed]), np.vstack([self.right, felt]), self.structure
        )

    def reweighed(self, factors: np.ndarray) -> Sensitivity:
        """With every residual's derivatives times its own factor, shape (n,)."""
        return Sensitivity.of(*(factors[:, None] * block for block in self.dense()))

    def widened(self, nuisances: int) -> Sensitivity:
        """With so many more nuisances, which nothing is known of: they stay where they are."""
        by_structure, by_nuisances = self.dense()
        return Sensitivity.of(by_structure, np.pad(by_nuisances, ((0, 0), (0, nuisances))))

    def dense(self) -> tuple[np.ndarray, np.ndarray]:
        """By the structure's parameters, shape (n, p), and by the nuisances, shape (n, q)."""
        whole = self.taken + self.right.T @ self.left if len(self.left) else self.taken
        return whole[: self.structure].T, whole[self.structure :].T
