"""The stiffness curve K of eq. (1) from a static test: a 15th-degree polynomial (paper, IV.A.1).

The paper fits NumPy's polynomial to the data at 0 psi. Two points need more care than it describes:

* In metres, the Vandermonde matrix of degree 15 has a condition number of 3e24, so the curve is represented in
  Chebyshev polynomials of the normalised coordinate z = 2 (x - lower) / (upper - lower) - 1.
* The model uses K outside the range that the testing machine covered (under vacuum the actuator folds some 5 mm beyond
  its contracted length). There the fit alone diverges, so the continuation gets a broad prior on its curvature and must
  not decrease; equilibria observed in step responses then constrain it (`StiffnessFit.with_equilibria`).

The fit is a Gaussian posterior and thus includes the uncertainty of every point of the curve.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike
from scipy.optimize import LinearConstraint, minimize

from bifa.errors import BifaError
from bifa.robot.stiffness import DEGREE
from lacuna.estimation.sampling import correlation_samples

CONTINUATION = 0.13  # greatest width on either side, over the static range; beyond it the curve is straight
_PRIOR_POINTS = 6  # on either side
_MIN_STATIC_SHARE = 0.9  # least share of the information from static loading for a shape to count as determined by it
_MIN_POINTS = 4 * (DEGREE + 1)


class UndeterminedError(BifaError):
    """A parameter cannot be determined from this data set; the text says which, and which experiment would help."""


@dataclass(frozen=True)
class StiffnessFit:
    """A posterior over stiffness curves.

    lower_m, upper_m: range of the polynomial; beyond it the model continues in a straight line.
    covered_m: range of displacements that the testing machine covered.
    coefficients: Chebyshev coefficients in z [N], shape (16,).
    information: the inverse of their covariance [1/N^2], shape (16, 16); `static` is the part from static loading, the
        rest is from the broad prior on the continuation and from equilibria.
    residual_N: RMS of the data about the curve, including hysteresis.
    """

    lower_m: float
    upper_m: float
    covered_m: tuple[float, float]
    coefficients: np.ndarray
    information: np.ndarray
    static: np.ndarray
    residual_N: float

    def force(self, x: np.ndarray) -> np.ndarray:
        """K(x) [N] at displacements x [m]."""
        return self._rows(x) @ self.coefficients

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the coefficients [N^2], shape (16, 16)."""
        return np.linalg.pinv(self.information, hermitian=True)

    def unstable_m(self) -> float:
        """The unstable equilibrium (the threshold of eq. (3)), where K falls through 0 between the stable states.
        Raises UndeterminedError if there is none."""
        x = np.linspace(*self.covered_m, 2001)
        force = self.force(x)
        falling = np.flatnonzero((force[:-1] > 0) & (force[1:] <= 0))
        if not len(falling):
            raise UndeterminedError("the force does not fall through 0 between its ends: the actuator is not bistable")
        i = falling[0]
        return float(x[i] + (x[i + 1] - x[i]) * force[i] / (force[i] - force[i + 1]))

    def with_equilibria(self, x: ArrayLike, force_N: ArrayLike, sd_N: ArrayLike) -> StiffnessFit:
        """The posterior given that the actuator rests at x [m] under a pressure force known to sd [N]."""
        rows = self._rows(np.asarray(x)) / np.asarray(sd_N)[:, None]
        information = self.information + rows.T @ rows
        target = self.information @ self.coefficients + rows.T @ (np.asarray(force_N) / np.asarray(sd_N))
        outside = _outside(self.lower_m, self.upper_m, self.covered_m)
        coefficients = _solve_monotone(information, target, self._rows(outside, derivative=1))
        return replace(self, coefficients=coefficients, information=information)

    def shapes(self) -> tuple[np.ndarray, np.ndarray]:
        """Independent changes of the curve, each by one standard deviation of the posterior.

        Returns the shapes (16, 16), row j holding the Chebyshev coefficients [N] of one change, and (16,), True for
        those determined by static loading. Any curve is `coefficients + z @ shapes`, where z has zero mean and unit
        covariance in the posterior: these are the coordinates of the joint fit. Shapes of the continuation come first,
        and the least certain first within each kind.
        """
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        static_share, turned = np.linalg.eigh(root.T @ self.static @ root)
        ways = []
        for subspace in (turned[:, static_share < _MIN_STATIC_SHARE], turned[:, static_share >= _MIN_STATIC_SHARE]):
            _, sizes, directions = np.linalg.svd((root @ subspace).T, full_matrices=False)
            ways.append(sizes[:, None] * directions)
        shapes = np.concatenate(ways)
        # Fix the signs, so that the coordinates do not depend on the linear algebra library.
        signs = np.sign(shapes[np.arange(len(shapes)), np.argmax(np.abs(shapes), axis=1)])
        return shapes * signs[:, None], np.arange(len(shapes)) >= np.sum(static_share < _MIN_STATIC_SHARE)

    def _rows(self, x: np.ndarray, derivative: int = 0) -> np.ndarray:
        return _rows(x, self.lower_m, self.upper_m, derivative)


def fit_stiffness(
    displacement_m: np.ndarray,
    force_N: np.ndarray,
    loading: np.ndarray,
    *,
    reach_m: tuple[float, float] | None = None,
) -> StiffnessFit:
    """Fit K to static data at 0 psi: displacements, forces, and whether the actuator was being extended, each of shape
    (n,). Loading and unloading have equal weights at every displacement that both cover, so that the curve runs through
    the middle of the hysteresis loop. `reach_m`: the least and greatest displacement at which the curve will be
    evaluated, if known. Raises UndeterminedError if there are too few points, their range is too small, or the force
    never changes."""
    x, force = np.asarray(displacement_m, float), np.asarray(force_N, float)
    if len(x) < _MIN_POINTS:
        raise UndeterminedError(f"a curve of degree {DEGREE} needs at least {_MIN_POINTS} points, not {len(x)}")
    covered = (float(x.min()), float(x.max()))
    width = covered[1] - covered[0]
    if width < 1e-3:
        raise UndeterminedError(f"the static test moved by only {width * 1e3:.2f} mm: no curve can be fitted to it")
    if np.ptp(force) == 0.0:
        raise UndeterminedError(f"the force is {force[0]:g} N throughout: is the load cell connected?")
    lower, upper = covered[0] - CONTINUATION * width, covered[1] + CONTINUATION * width
    if reach_m is not None:
        lower = max(lower, min(reach_m[0], covered[0]) - 0.01 * width)
        upper = min(upper, max(reach_m[1], covered[1]) + 0.01 * width)

    loading = np.asarray(loading, bool)
    rows, weight = _rows(x, lower, upper), _even_weights(x, loading)
    scaled = rows * np.sqrt(weight)[:, None]
    variance = max(_noise_variance(rows, force, loading), 1e-12)

    outside = _outside(lower, upper, covered)
    # Over the width of the continuation, curvature may change the force by several times the greatest measured force.
    bend = 10.0 * np.abs(force).max() / max(covered[0] - lower, upper - covered[1]) ** 2
    prior = _rows(outside, lower, upper, derivative=2) / bend
    information = scaled.T @ scaled / variance + prior.T @ prior
    target = scaled.T @ (force * np.sqrt(weight)) / variance
    coefficients = _solve_monotone(information, target, _rows(outside, lower, upper, derivative=1))
    final = force - rows @ coefficients
    return StiffnessFit(
        lower,
        upper,
        covered,
        coefficients,
        information,
        scaled.T @ scaled / variance,
        float(np.sqrt(np.average(final**2, weights=weight))),
    )


def _rows(x: np.ndarray, lower: float, upper: float, derivative: int = 0) -> np.ndarray:
    """Chebyshev polynomials at x (or derivatives by x), shape (n, 16), continued straight beyond the ends."""
    to_z = 2.0 / (upper - lower)
    x = np.atleast_1d(np.asarray(x, float))
    inside = np.clip(x, lower, upper)
    z = (inside - lower) * to_z - 1.0
    slopes = chebyshev.chebvander(z, DEGREE - 1) @ chebyshev.chebder(np.eye(DEGREE + 1)) * to_z
    if derivative == 0:
        return chebyshev.chebvander(z, DEGREE) + slopes * (x - inside)[:, None]
    if derivative == 1:
        return slopes
    differentiated = chebyshev.chebder(np.eye(DEGREE + 1), m=derivative)
    return chebyshev.chebvander(z, DEGREE - derivative) @ differentiated * to_z**derivative


def _outside(lower: float, upper: float, covered: tuple[float, float]) -> np.ndarray:
    return np.concatenate(
        [np.linspace(lower, covered[0], _PRIOR_POINTS), np.linspace(covered[1], upper, _PRIOR_POINTS)]
    )


def _even_weights(x: np.ndarray, loading: np.ndarray, bins: int = 100) -> np.ndarray:
    """Weights, of mean 1, that give both branches equal total weight at every displacement that both cover."""
    place = np.minimum(((x - x.min()) / np.ptp(x) * bins).astype(int), bins - 1)
    up = np.bincount(place[loading], minlength=bins)
    down = np.bincount(place[~loading], minlength=bins)
    both = (up > 0) & (down > 0)
    total = up + down
    share = np.where(both, total / 2.0, total)
    weight = np.where(loading, share[place] / np.maximum(up[place], 1), share[place] / np.maximum(down[place], 1))
    return weight / weight.mean()


def _noise_variance(rows: np.ndarray, force: np.ndarray, loading: np.ndarray) -> float:
    """Variance of one sample, inflated by serial correlation. Each branch is compared with its own curve, since the
    distance between the branches is hysteresis, not noise."""
    variance = 0.0
    for branch in (loading, ~loading):
        if branch.sum() > 2 * (DEGREE + 1):
            own = np.linalg.lstsq(rows[branch], force[branch], rcond=None)[0]
            residual = force[branch] - rows[branch] @ own
            share = branch.mean() * branch.sum() / (branch.sum() - DEGREE - 1)
            square = float(np.mean(residual**2))
            variance += share * square * (correlation_samples([residual / square**0.5]) if square else 1.0)
    return variance


def _solve_monotone(information: np.ndarray, target: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Minimise c'Ac/2 - b'c subject to slopes @ c >= 0, so that the continuation does not decrease."""
    free = np.linalg.solve(information, target)
    if (slopes @ free >= 0.0).all():
        return free
    root = np.linalg.cholesky(information)  # in whitened coordinates, the problem is well conditioned
    inverse = np.linalg.inv(root.T)
    center = root.T @ free
    turned = slopes @ inverse
    scale = np.abs(turned).max()
    solution = minimize(
        lambda y: 0.5 * np.sum((y - center) ** 2),
        center,
        jac=lambda y: y - center,
        constraints=LinearConstraint(turned / scale, 0.0, np.inf),
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-12},
    )
    return inverse @ solution.x
