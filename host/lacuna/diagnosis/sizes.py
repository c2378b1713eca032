"""Starting points of fits with one more effect: a grid of sizes of either sign, at peak frequencies of the residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lacuna.diagnosis.spectrum import peaks
from lacuna.estimation.fit import Fit, starting_point
from lacuna.estimation.problem import Problem
from lacuna.estimation.structure import Structure
from lacuna.system import Effect

_PEAKS = 3  # number of peaks of the residual's spectrum at which a frequency parameter starts


def grown(parent: Fit, effect: str) -> Problem:
    """The problem of a fit with one more effect, on the same trials and against the same floor."""
    structure, problem = parent.structure, parent.problem
    return Problem(
        Structure(structure.system, (*structure.effects, effect)), problem.trials, problem.floor, problem.view
    )


def starts(parent: Fit, structure: Structure, effect: str) -> list[np.ndarray]:
    """Starting vectors: the parent's values with the effect at a grid of sizes of either sign."""
    described = structure.system.effects[effect]
    base = structure.separate_ordered(starting_point(parent, structure), effect)
    vectors = [v for factor in described.start_factors for v in sized(structure, base, effect, factor)]
    if described.frequency is None:
        return vectors
    return [v for vector in vectors for v in _at_peaks(parent, structure, described, vector)]


def one_more(parent: Fit, effect: str) -> tuple[Problem, list[np.ndarray], Sequence[np.ndarray]]:
    """The inputs of a fit with one more effect: its problem, starting vectors, and the parent's nuisances."""
    problem = grown(parent, effect)
    return problem, starts(parent, problem.structure, effect), parent.solution.point.nuisances


def sized(structure: Structure, base: np.ndarray, effect: str, factor: float) -> list[np.ndarray]:
    """Copies of `base` with an effect at `factor` times its typical size, of either sign where its bounds allow."""
    described = structure.system.effects[effect]
    parameters = described.parameters[: described.sizes]
    at, vectors = [structure.names.index(name) for name in described.size_names], []
    for signs in _signs(described):
        vector = base.copy()
        for index, parameter, sign in zip(at, parameters, signs, strict=True):
            size = described.absent + sign * factor * (parameter.value - described.absent)
            vector[index] = np.clip(size, parameter.lower, parameter.upper)
        vectors.append(vector)
    return vectors


def _at_peaks(parent: Fit, structure: Structure, effect: Effect, vector: np.ndarray) -> list[np.ndarray]:
    """Copies of `vector` with the effect's frequency at each of the residual's most prominent frequencies."""
    index = structure.names.index(f"{effect.name}.{effect.frequency}")
    parameter = structure.parameters[index]
    problem = parent.problem
    found = []
    prominent = peaks(problem.trials, parent.scaled_residuals(), parameter.lower, parameter.upper, _PEAKS)
    for frequency in prominent or [parameter.value]:  # there are no peaks in a range that no record resolves
        moved = vector.copy()
        moved[index] = frequency
        found.append(moved)
    return found


def _signs(effect: Effect) -> list[tuple[float, ...]]:
    """The sign combinations to try for the sizes, relative to their absent values."""
    both_ways = all(p.lower < effect.absent < p.upper for p in effect.parameters[: effect.sizes])
    positive = (1.0,) * effect.sizes
    return [positive, tuple(-s for s in positive)] if both_ways else [positive]
