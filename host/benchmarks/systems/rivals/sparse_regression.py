"""pysindy: differentiate the measurements, regress acceleration on candidate terms, keep the few that matter."""

import warnings

import numpy as np
import pysindy
from scipy.signal import savgol_filter

from benchmarks.systems.problem import KnownProblem, RivalAnswer, Terms
from benchmarks.systems.rivals.best_subset import bic
from lacuna import Record

THRESHOLDS = np.logspace(-4, 0, 25)  # of the largest coefficient, columns normalised
WINDOWS = (9, 15, 21, 31, 45, 61)  # window lengths of the derivative filter, in samples,
ORDER = 5  # and order of its polynomial: 3 gives too small an acceleration and too large a mass


def solve(problem: KnownProblem) -> RivalAnswer:
    """The model with the least BIC of its free run over all windows and thresholds (Mangan et al., 2017)."""
    tried = {(window, *found): found for window in WINDOWS for found in path(problem, problem.terms, window)}
    best = min(tried.values(), key=lambda found: bic(problem, found))
    named = dict.fromkeys(name.split(".")[0] for name in best if "." in name)
    return RivalAnswer(tuple(named), lambda record: problem.predict(record, best))


def path(problem: KnownProblem, terms: Terms, window: int) -> list[dict[str, float]]:
    """The remaining parameters at each threshold, as the simulator's parameters. Models without the input are dropped,
    and those with a parameter outside its bounds, such as a negative drag."""
    derived = [_derived(record, problem.output, terms, window) for record in problem.fitted]
    states, rates, inputs = (list(columns) for columns in zip(*derived, strict=True))
    together = np.hstack([np.vstack(states), np.vstack(inputs)]).T
    norms = {name: np.linalg.norm(term(*together)) for name, term in terms.of.items()}
    offered = {name: term for name, term in terms.of.items() if norms[name] > 0.0}  # those that the records excite
    sample_s = float(np.median(np.diff(problem.fitted[0].time_s)))

    def coefficients(threshold: float) -> dict[str, float]:
        optimizer = pysindy.STLSQ(threshold, alpha=1e-12, normalize_columns=True)
        model = pysindy.SINDy(optimizer, pysindy.CustomLibrary(list(offered.values())))
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sparsity parameter is too big", UserWarning)  # at the end of the path
            model.fit(states, t=sample_s, x_dot=rates, u=inputs)
        return dict(zip(offered, model.coefficients()[-1], strict=True))  # of the highest derivative

    largest = max(abs(c) * norms[name] for name, c in coefficients(0.0).items())
    found = [_parameters(coefficients(threshold * largest), terms.inertia) for threshold in THRESHOLDS]
    bounds = dict(problem.free(problem.library))
    return [f for f in found if f and all(bounds[n].lower <= value <= bounds[n].upper for n, value in f.items())]


def _parameters(coefficients: dict[str, float], inertia: str) -> dict[str, float]:
    """Parameters of a = (u - sum of parameter x term) / inertia; empty if the input has no effect."""
    if coefficients[inertia] == 0.0:
        return {}
    mass = 1.0 / coefficients[inertia]
    return {n: mass if n == inertia else -c * mass for n, c in coefficients.items() if c != 0.0}


def _derived(record: Record, output: str, terms: Terms, window: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The states (position and speed), their rates, and the inputs, shape (n, order), (n, order), (n, inputs), in SI
    units. Inputs are filtered like the position, so that both sides lose the same."""
    sample_s = float(np.median(np.diff(record.time_s)))

    def filtered(column: np.ndarray, order: int = 0) -> np.ndarray:
        return savgol_filter(column, window, ORDER, deriv=order, delta=sample_s)

    derived = [filtered(terms.unit * record.channels[output], order) for order in range(terms.order + 1)]
    inputs = np.column_stack([filtered(record[name]) for name in terms.inputs])
    return np.column_stack(derived[:-1]), np.column_stack(derived[1:]), inputs
