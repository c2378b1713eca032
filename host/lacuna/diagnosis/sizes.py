"""Starting points of fits with one more effect: a grid of sizes of either sign, at peak frequencies of the residual."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter

from lacuna.estimation.fit import Fit
from lacuna.estimation.problem import Problem
from lacuna.estimation.sampling import resample_evenly, sample_period
from lacuna.estimation.structure import Structure
from lacuna.system import Channels, Record

_PEAKS = 3  # number of peaks of the residual's spectrum at which a frequency parameter starts
_CELLS_A_LINE = 3  # minimum number of grid cells within a spectral line's width in the longest record
_MOST_CELLS = 200_000
_LOCAL = 100  # cells over which the background is taken that a peak must stand out from
_MAX_POWER_RATIO = 20.0  # cap on a trial's power at a frequency, in multiples of its background


def starts(parent: Fit, structure: Structure, effect: str) -> list[np.ndarray]:
    """Starting vectors: the parent's values with the effect at a grid of sizes of either sign, and its frequency, if it
    has one, at each of the residual's most prominent ones."""
    described = structure.system.effects[effect]
    base = structure.separate_ordered(structure.start(parent.theta), effect)
    vectors = [v for factor in described.start_factors for v in sized(structure, base, effect, factor)]
    if described.frequency is None:
        return vectors
    at = structure.names.index(f"{effect}.{described.frequency}")
    parameter = structure.parameters[at]
    found = peaks(parent.problem.trials, parent.scaled_residuals(), parameter.lower, parameter.upper, _PEAKS)
    # there are no peaks in a range that no record resolves
    return [np.where(np.arange(len(v)) == at, hz, v) for v in vectors for hz in found or [parameter.value]]


def one_more(parent: Fit, effect: str) -> tuple[Problem, list[np.ndarray], Sequence[np.ndarray]]:
    """The inputs of a fit with one more effect on the same trials and against the same floor: its problem, starting
    vectors, and the parent's nuisances."""
    known, old = parent.structure, parent.problem
    problem = Problem(Structure(known.system, (*known.effects, effect)), old.trials, old.floor, old.view)
    return problem, starts(parent, problem.structure, effect), parent.solution.point.nuisances


def sized(structure: Structure, base: np.ndarray, effect: str, factor: float) -> list[np.ndarray]:
    """Copies of `base` with an effect at `factor` times its typical size, of either sign where its bounds allow."""
    described = structure.system.effects[effect]
    parameters = described.parameters[: described.sizes]
    at, vectors = [structure.names.index(name) for name in described.size_names], []
    for sign in (1.0, -1.0) if all(p.lower < described.absent < p.upper for p in parameters) else (1.0,):
        vector = base.copy()
        for index, parameter in zip(at, parameters, strict=True):
            size = described.absent + sign * factor * (parameter.value - described.absent)
            vector[index] = np.clip(size, parameter.lower, parameter.upper)
        vectors.append(vector)
    return vectors


def peaks(
    trials: Sequence[Record], scaled: Sequence[Channels], lower_hz: float, upper_hz: float, count: int
) -> list[float]:
    """The `count` most prominent frequencies [Hz] of the residuals `scaled`, by power over background, all pooled."""
    from scipy.signal import find_peaks  # slow to import

    fastest_s = min(sample_period(trial.time_s) for trial in trials)
    upper_hz = min(upper_hz, max(0.5 / fastest_s, 2.0 * lower_hz))  # above that nothing shows
    resolution_hz = _resolution_hz(max(trial.time_s[-1] - trial.time_s[0] for trial in trials), upper_hz - lower_hz)
    frequencies = np.arange(lower_hz, upper_hz, resolution_hz)
    pooled, weight = np.zeros(len(frequencies)), np.zeros(len(frequencies))
    for trial, channels in zip(trials, scaled, strict=True):
        sample_s = sample_period(trial.time_s)
        resolved = (frequencies > 1.5 / (trial.time_s[-1] - trial.time_s[0])) & (frequencies < 0.4 / sample_s)
        for residual in channels.values():
            power = _power(np.nan_to_num(resample_evenly(trial.time_s, residual)), sample_s, frequencies, resolution_hz)
            background = median_filter(power, size=_LOCAL, mode="nearest")
            pooled += resolved * np.minimum(power / np.maximum(background, 1e-30), _MAX_POWER_RATIO)
            weight += resolved
    mean = pooled / np.maximum(weight, 1.0)
    found, _ = find_peaks(mean)
    return [float(frequencies[k]) for k in sorted(found, key=lambda k: -mean[k])[:count]]


def _resolution_hz(longest_s: float, range_hz: float) -> float:
    """Grid spacing: the largest of 1, 2 or 5 times a power of ten that resolves a line of the longest record."""
    finest = 1.0 / (_CELLS_A_LINE * longest_s)
    decade = 10.0 ** np.floor(np.log10(finest))
    largest = max(digit for digit in (1.0, 2.0, 5.0) if digit * decade <= finest)
    return max(largest * decade, range_hz / _MOST_CELLS)


def _power(residual: np.ndarray, sample_s: float, frequencies: np.ndarray, resolution_hz: float) -> np.ndarray:
    """Power spectrum of the tapered trace at `frequencies`."""
    tapered = (residual - residual.mean()) * np.hanning(len(residual))
    size = 1 << int(np.ceil(np.log2(max(len(residual), 1.0 / (resolution_hz * sample_s)))))
    return np.interp(frequencies, np.fft.rfftfreq(size, sample_s), np.abs(np.fft.rfft(tapered, size)) ** 2)
