"""What the parameters of a fit could take up of a change in the residuals, to first order."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lacuna.estimation.fit import Fit
from lacuna.estimation.sensitivity import Sensitivity


def stacked(sensitivities: Sequence[Sensitivity]) -> tuple[np.ndarray, np.ndarray]:
    """Of all trials' residuals, n in all: derivatives by the structure, (n, p), and by the trials' nuisances, each in
    its own rows, (n, all of them)."""
    jacobians = [s.dense() for s in sensitivities]
    rows = sum(j.shape[0] for j, _ in jacobians)
    own = sum(k.shape[1] for _, k in jacobians)
    blocks = np.zeros((rows, own))
    row = column = 0
    for _, k in jacobians:
        blocks[row : row + k.shape[0], column : column + k.shape[1]] = k
        row, column = row + k.shape[0], column + k.shape[1]
    return np.vstack([j for j, _ in jacobians]), blocks


def remaining_after(fitted: Fit) -> tuple[np.ndarray, np.ndarray]:
    """An orthonormal basis, (n, q), of what the fit's parameters and nuisances can move the residuals by, and the
    residuals, (n,), less that."""
    problem, point = fitted.problem, fitted.solution.point
    every = range(len(fitted.structure.names))
    taken = fitted.solution.sensitivities or problem.jacobians(point, every, problem.first_steps())
    basis = _orthonormal(np.hstack(stacked(taken)))
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
