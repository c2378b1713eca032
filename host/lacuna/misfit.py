"""What a diagnosis leaves tells of the floor it was made against: its level, and the correlation time of the noise.

Where nothing on offer comes near the floor, explanations are compared at the level of what the best of them leaves.
Residuals of thousands of floors are compressed in a fit, so that one bad sample cannot outweigh everything; where all
samples are that bad, explanations that differ by ten times look alike. The comparison is then made again with a floor
raised to a fraction of what was left, for as long as that leaves less.

Where no repeats show the noise's correlation time, that of the residual stands for it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable

import numpy as np

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.estimation.fit import evaluate_on
from lacuna.estimation.problem import SOFT_LIMIT
from lacuna.estimation.sampling import correlation_samples, evenly, sample_period
from lacuna.function_system import FunctionSystem

_FRACTION = 0.05  # of what is left: still within reach of the range in which residuals count by their squares
_WORTH = 1.25  # times the floor: raised by less, it would change no comparison
_ROUNDS = 3
_LONG = 3.0  # samples: what remembers itself for less is white for all that matters

Key = tuple[str, str]


def compared_at_misfit(
    system: FunctionSystem, found: Diagnosis, again: Callable[[FunctionSystem], Diagnosis]
) -> tuple[Diagnosis, dict[Key, float]]:
    """The diagnosis at the level of its own misfit, and by experiment and channel the floor that was raised, as it was;
    `found` and nothing where it is near its floor."""
    was = {key: noise.sd for key, noise in found.search.floor.channels.items()}
    raised: dict[Key, float] = {}
    left = _left(found)
    for _ in range(_ROUNDS):
        level = {key: _FRACTION * rms for key, rms in left.items() if rms > SOFT_LIMIT * was[key]}
        level = {key: sd for key, sd in level.items() if sd > _WORTH * was[key]}
        if not level or found.verdict == "none":
            break
        next_found = again(system.with_floor(level))
        next_left = _left(next_found)
        if next_found.verdict == "none" or (raised and _mean_log(next_left, left) >= 0.0):
            break
        found, left, raised = next_found, next_left, {key: was[key] for key in level}
        if _mean_log(left, level) > 0.0:  # what is left shows above the raised floor: nothing was good enough too soon
            break
    return found, raised


def _left(found: Diagnosis) -> dict[Key, float]:
    """RMS of what the final explanation leaves on the trials that it is fitted to, in the channels' units."""
    squares: dict[Key, list[float]] = {}
    residuals = found.final.residuals()
    for trial in found.final.problem.trials:
        for channel, residual in residuals[trial.name].items():
            if (known := residual[np.isfinite(residual)]).size:
                squares.setdefault((trial.experiment, channel), []).append(float(np.mean(known**2)))
    return {key: float(np.sqrt(np.mean(values))) for key, values in squares.items()}


def _mean_log(one: dict[Key, float], other: dict[Key, float]) -> float:
    """By how much `one` is above `other`, where both are known."""
    return float(np.mean([np.log(one[key] / other[key]) for key in one.keys() & other.keys()]))


def left_over_s(diagnosis: Diagnosis) -> dict[str, float]:
    """By channel without repeats the correlation time of the residual, in seconds, 0 where it is white."""
    trials, floor = diagnosis.base.structure.system.trials, diagnosis.search.floor
    residuals = evaluate_on(diagnosis.final, trials).residuals()
    traces: dict[Key, list[np.ndarray]] = defaultdict(list)
    periods: dict[Key, list[float]] = defaultdict(list)
    for trial in trials:
        for channel, residual in residuals[trial.name].items():
            key, known = (trial.experiment, channel), residual[np.isfinite(residual)]
            if known.size and not floor.of(*key).repeats:
                traces[key].append(evenly(trial.time_s, residual / max(float(np.std(known)), 1e-300)))
                periods[key].append(sample_period(trial.time_s))
    found: dict[str, float] = defaultdict(float)
    for key, members in traces.items():
        samples = correlation_samples(members)  # of exponential memory: twice the correlation time
        seconds = 0.5 * samples * float(np.median(periods[key])) if samples > _LONG else 0.0
        found[key[1]] = max(found[key[1]], seconds)
    return found
