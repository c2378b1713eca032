"""Revise the noise floor after a diagnosis, from the residual of the best explanation: its level and correlation time.

Large residuals are compressed in a fit, so that one bad sample cannot outweigh everything. If no explanation comes near
the floor, all samples are that bad, and explanations whose errors differ by a factor of ten look alike. The diagnosis
is then repeated with the floor raised to a fraction of the best explanation's residual, for as long as that lowers the
residual.

If there are no repeats to show the noise's correlation time, that of the residual is used instead.
"""

from collections import defaultdict
from collections.abc import Callable

import numpy as np

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.estimation.fit import evaluate_on, rms_by_channel
from lacuna.estimation.problem import SOFT_LIMIT
from lacuna.estimation.sampling import correlation_samples, resample_evenly, sample_period
from lacuna.function_system import FunctionSystem

_FRACTION = 0.05  # of the residual, as the raised floor: residuals are then only moderately compressed
_MIN_RAISE_RATIO = 1.25  # times the floor; raising it by less would change no comparison
_ROUNDS = 3
_MIN_CORRELATION_SAMPLES = 3.0  # samples; a residual correlated over fewer counts as white

Key = tuple[str, str]


def compare_at_misfit(
    system: FunctionSystem, found: Diagnosis, again: Callable[[FunctionSystem], Diagnosis]
) -> tuple[Diagnosis, dict[Key, float]]:
    """Repeat a diagnosis with raised floors if it is far from them. Returns the diagnosis, and the original value of
    each floor that was raised, by (experiment, channel); `found` and an empty dict if no floor had to be raised."""
    was = {key: noise.sd for key, noise in found.search.floor.channels.items()}
    raised: dict[Key, float] = {}
    left = residual_rms(found)
    for _ in range(_ROUNDS):
        level = {key: _FRACTION * rms for key, rms in left.items() if rms > SOFT_LIMIT * was[key]}
        level = {key: sd for key, sd in level.items() if sd > _MIN_RAISE_RATIO * was[key]}
        if not level or found.verdict == "none" or found.is_stopped:
            break
        next_found = again(system.with_floor(level))
        next_left = residual_rms(next_found)
        if next_found.verdict == "none" or (raised and _mean_log(next_left, left) >= 0.0):
            break
        found, left, raised = next_found, next_left, {key: was[key] for key in level}
        if _mean_log(left, level) > 0.0:  # so the raised floor made no explanation pass as sufficient too early
            break
    return found, raised


def residual_rms(found: Diagnosis) -> dict[Key, float]:
    """RMS residual of the final explanation on its fitted trials, in the channels' units."""
    return rms_by_channel(found.final.problem.trials, found.final.residuals().values())


def _mean_log(one: dict[Key, float], other: dict[Key, float]) -> float:
    """Mean logarithm of the ratio of `one` to `other`, over their common keys."""
    return float(np.mean([np.log(one[key] / other[key]) for key in one.keys() & other.keys()]))


def residual_correlation_s(diagnosis: Diagnosis) -> dict[str, float]:
    """Correlation time of the residual in seconds, by channel without repeats; 0 if it is white."""
    trials, floor = diagnosis.base.structure.system.trials, diagnosis.search.floor
    residuals = evaluate_on(diagnosis.final, trials).residuals()
    traces: dict[Key, list[np.ndarray]] = defaultdict(list)
    periods: dict[Key, list[float]] = defaultdict(list)
    for trial in trials:
        for channel, residual in residuals[trial.name].items():
            key, known = (trial.experiment, channel), residual[np.isfinite(residual)]
            if known.size and not floor.of(*key).repeats:
                traces[key].append(resample_evenly(trial.time_s, residual / max(float(np.std(known)), 1e-300)))
                periods[key].append(sample_period(trial.time_s))
    found: dict[str, float] = defaultdict(float)
    for key, members in traces.items():
        samples = correlation_samples(members)  # twice the correlation time, for an exponential correlation
        seconds = 0.5 * samples * float(np.median(periods[key])) if samples > _MIN_CORRELATION_SAMPLES else 0.0
        found[key[1]] = max(found[key[1]], seconds)
    return found
