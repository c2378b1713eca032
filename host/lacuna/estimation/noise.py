"""The noise floor of a system's trials, estimated from repeats.

The spread from run to run is often several times the sensor's noise, so a residual is structure only where it exceeds
the differences between repeats of a condition. Three numbers per channel describe that spread: a standard deviation,
the share of it that is proportional to the reading, and a timing jitter for records that jump (a snap-through 10 ms
later is a huge residual but means nothing). A fourth, the correlation length, says how many samples carry one
independent piece of information.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.polynomial.hermite_e import hermegauss
from scipy.ndimage import median_filter
from scipy.optimize import brentq

from lacuna.check.numbers import fast_noise
from lacuna.estimation.sampling import correlation_samples, resample_evenly, sample_period
from lacuna.system import Channels, Record, System, by_channel, groups_of_repeats

REFIT_SHARE = 0.9  # a new floor below this share of the old one changes the weights enough for another refit
MAX_REESTIMATES = 5  # re-estimates of a floor, at most
# Gauss-Hermite quadrature: the mean over a normally distributed shift in time, in standard deviations of it.
_SHIFT_NODES, _SHIFT_WEIGHTS = hermegauss(8)
_SHIFT_WEIGHTS /= _SHIFT_WEIGHTS.sum()
_LONGEST_JITTER_S = 0.5  # this, and the window, are shorter in a record of less than a second, in proportion
_MOVING_SIGMAS = 6.0
_WINDOW_S = 0.05
_SAME_VALUE = 1e-9  # of a record's range: values closer than this are equal
_MAX_DISTINCT_SHARE = 0.9  # distinct values per sample, at most, in a record whose values recur
_GRID_REL_TOL = 1e-3  # of a rounding step: deviation from a multiple, at most
_MEAN_DEVIATION = (2.0 / np.pi) ** 0.5  # mean absolute value of a standard normal variable
_MIN_GROWTH_GAIN = 4.0  # log-likelihood for noise that grows with the reading: by chance in one record of 200
_CONSTANT_SHARES = np.geomspace(1e-4, 1.0, 41)  # of the variance, that are tried; the last is noise that does not grow


@dataclass(frozen=True)
class ChannelNoise:
    """Spread of one channel in one experiment.

    `sd` is the standard deviation in the channel's unit, `jitter_s` that of the timing of events, `samples_per_piece`
    the number of neighbouring samples that count as one independent observation. `repeats` is the number of pairs of
    repeats that it was estimated from; 0: there are none. `constant_share` is the share of the variance that does not
    depend on the reading: 1 for most sensors; the rest grows with its square. Readings have an RMS of `reading`, at
    which the standard deviation is `sd`.
    """

    sd: float
    jitter_s: float
    samples_per_piece: float
    repeats: int
    constant_share: float = 1.0
    reading: float = 1.0

    @property
    def grows(self) -> bool:
        """Whether the noise grows with the reading."""
        return self.constant_share < 1.0

    def sd_at(self, readings: np.ndarray) -> np.ndarray:
        """Standard deviation at each reading, without the jitter, shape as `readings`; `sd` where there is none."""
        if not self.grows:
            return np.full(np.shape(readings), self.sd)
        squares = np.nan_to_num((readings / self.reading) ** 2, nan=1.0)
        return self.sd * np.sqrt(self.constant_share + (1.0 - self.constant_share) * squares)

    @property
    def per_piece(self) -> float:
        """Standard deviation of a mean over n samples, times sqrt(n)."""
        return self.sd * self.samples_per_piece**0.5


@dataclass(frozen=True)
class NoiseFloor:
    """Noise of every channel in every experiment: `channels` by (experiment, channel)."""

    channels: Mapping[tuple[str, str], ChannelNoise]

    def of(self, experiment: str, channel: str) -> ChannelNoise:
        """Noise of a channel in an experiment; if unknown there, the largest that it has in any other experiment."""
        if (experiment, channel) in self.channels:
            return self.channels[experiment, channel]
        others = (noise for (_, known), noise in self.channels.items() if known == channel)
        return max(others, key=lambda noise: noise.per_piece)

    def sd(self, trial: Record, channel: str) -> np.ndarray:
        """Standard deviation of each sample, shape (n,); larger where a record moves fast or noise grows with it."""
        noise = self.of(trial.experiment, channel)
        if not (noise.jitter_s or noise.grows):
            return np.full(trial.time_s.shape, noise.sd)
        samples = _smooth(trial.channels[channel])
        sd = noise.sd_at(samples)
        return np.sqrt(sd**2 + _shift_variance(trial.time_s, samples, noise.jitter_s, sd)) if noise.jitter_s else sd

    def lowered_by(self, other: NoiseFloor) -> NoiseFloor:
        """Return the lower of two floors for each channel. Both are upper bounds, since a model that does not fit adds
        its own differences to those between runs. Channels that `other` lacks are kept."""
        known = other.channels
        return NoiseFloor({k: min(n, known.get(k, n), key=lambda c: c.per_piece) for k, n in self.channels.items()})

    def raised(self, factors: Mapping[tuple[str, str], float]) -> NoiseFloor:
        """Return the floor with the standard deviation of some channels multiplied by `factors`."""
        known = self.channels.items()
        return NoiseFloor({k: replace(n, sd=factors[k] * n.sd) if k in factors else n for k, n in known})

    def share_of(self, other: NoiseFloor) -> float:
        """Smallest ratio of this floor to `other` over all channels."""
        return min(n.per_piece / other.channels[k].per_piece for k, n in self.channels.items())


def estimate_noise(
    system: System, trials: Sequence[Record], residuals: Mapping[str, Channels] | None = None
) -> NoiseFloor:
    """Estimate the noise floor of `trials` from the differences between repeats. If given, `residuals` (measured minus
    predicted, by trial name and channel) are used instead of the measurements: a sharper estimate, because the fit
    accounts for each trial's nuisances, and model errors that repeats have in common cancel. A channel without repeats
    gets its floor from fast noise, or from `System.noise_time_s`."""
    measured = {trial.name: trial.channels for trial in trials}
    basis = measured if residuals is None else residuals
    by_key: dict[tuple[str, str], list[tuple[Record, Record]]] = defaultdict(list)
    for first, second in repeat_pairs(trials):
        for channel in first.channels.keys() & second.channels.keys():
            if np.isfinite(_difference(first, second, channel, measured)).any():
                by_key[first.experiment, channel].append((first, second))
    channels = {}
    for key, members in by_channel(trials).items():
        sensor = system.sensor_noise(*key)
        if pairs := by_key.get(key):
            channels[key] = _from_pairs(pairs, key[1], sensor, basis)
        elif correlated_s := system.noise_time_s(*key):
            channels[key] = _of_correlated(members, key[1], correlated_s, sensor, basis)
        else:
            channels[key] = _of_fast_noise(members, key[1], sensor, basis)
    return NoiseFloor(channels)


def repeat_pairs(trials: Sequence[Record]) -> Iterator[tuple[Record, Record]]:
    """All pairs of trials with the same experiment and condition."""
    for members in groups_of_repeats(trials):
        yield from combinations(members, 2)


def _from_pairs(
    pairs: Sequence[tuple[Record, Record]], channel: str, sensor: float, basis: Mapping[str, Channels]
) -> ChannelNoise:
    differences, moving = [], []
    for first, second in pairs:
        differences.append(_difference(first, second, channel, basis))
        also = np.interp(first.time_s, second.time_s, _moves(second, channel).astype(float)) > 0
        moving.append(_moves(first, channel) | also)
    everything = np.concatenate(differences)
    known = np.isfinite(everything)
    still = known & ~np.concatenate(moving)
    if still.sum() < 20:
        still = known
    sd = np.sqrt(np.mean(everything[still] ** 2))
    least = max(sensor, least_sd([trial for pair in pairs for trial in pair], channel))
    records = [(first.time_s, _smooth(first.channels[channel])) for first, _ in pairs]
    constant = ChannelNoise(float(max(sd, least)), 0.0, 1.0, len(pairs))
    growing = _growing(constant, np.concatenate([samples for _, samples in records])[known], everything[known], least)
    noise, likelihood = _with_jitter(constant, records, differences, moving)
    if growing.grows:
        growing, likelier = _with_jitter(growing, records, differences, moving)
        if likelier - likelihood > _MIN_GROWTH_GAIN * noise.samples_per_piece:
            return growing
    return noise


def _growing(noise: ChannelNoise, readings: np.ndarray, differences: np.ndarray, least: float) -> ChannelNoise:
    """Return `noise` with the likeliest constant share of the variance by `differences` at `readings`, shape (n,)."""
    reading = float(np.sqrt(np.nanmean(readings**2)))
    if not reading > 0.0:
        return noise
    squares = np.nan_to_num((readings / reading) ** 2, nan=1.0)
    shapes = np.sqrt(_CONSTANT_SHARES[:, None] + (1.0 - _CONSTANT_SHARES[:, None]) * squares)
    means = np.maximum(np.mean(np.abs(differences) / shapes, axis=1), 1e-300)
    best = int(np.argmin(np.log(means) + np.log(shapes).mean(axis=1)))
    sd = max(float(np.sqrt(np.mean((differences / shapes[best]) ** 2))), least)
    share = min(max(float(_CONSTANT_SHARES[best]), (least / sd) ** 2), 1.0)
    return replace(noise, sd=sd, constant_share=share, reading=reading)


def _with_jitter(
    noise: ChannelNoise,
    records: Sequence[tuple[np.ndarray, np.ndarray]],
    differences: Sequence[np.ndarray],
    moving: Sequence[np.ndarray],
) -> tuple[ChannelNoise, float]:
    """Return `noise` with the jitter and the correlation length that the differences then have, and the log-likelihood
    of their absolute values (a Laplace distribution, so that outliers do not pass for jitter or growth)."""
    sds = [noise.sd_at(samples) for _, samples in records]
    jitter_s, scaled, likelihood = _jitter(records, differences, moving, sds), [], 0.0
    for record, difference, sd in zip(records, differences, sds, strict=True):
        total = np.sqrt(sd**2 + _shift_variance(*record, jitter_s, sd)) if jitter_s else sd
        z = difference / total
        scaled.append(resample_evenly(record[0], z))
        known = np.isfinite(z)
        likelihood -= float(np.sum(np.log(total[known]) + np.abs(z[known]) / _MEAN_DEVIATION))
    return replace(noise, jitter_s=float(jitter_s), samples_per_piece=correlation_samples(scaled)), likelihood


def _of_fast_noise(
    members: Sequence[Record], channel: str, sensor: float, basis: Mapping[str, Channels]
) -> ChannelNoise:
    """Floor without repeats or a declared correlation time, from the fast noise of `basis`: residuals, or the records
    themselves, which give an upper bound, since a record may itself vary fast."""
    sd = float(np.median([fast_noise(trial.time_s, basis[trial.name][channel]) for trial in members]))
    return ChannelNoise(max(sd, sensor, least_sd(members, channel)), 0.0, 1.0, 0)


def _of_correlated(
    members: Sequence[Record], channel: str, correlated_s: float, sensor: float, basis: Mapping[str, Channels]
) -> ChannelNoise:
    """Floor without repeats but with a declared correlation time, from the changes of `basis` within that time, since
    slower changes are not noise. `basis` is residuals, or the records, which give an upper bound."""
    changes, pieces = [], []
    for trial in members:
        period, samples = sample_period(trial.time_s), resample_evenly(trial.time_s, basis[trial.name][channel])
        lag = min(max(1, round(correlated_s / period)), len(samples) // 2)
        kept = np.exp(-period / correlated_s)
        changes.append((samples[lag:] - samples[:-lag]) / np.sqrt(2.0 * (1.0 - kept**lag)))
        pieces.append((1.0 + kept) / (1.0 - kept))
    if not np.isfinite(np.concatenate(changes)).any():  # samples are further apart than that: their noise is white
        return _of_fast_noise(members, channel, sensor, basis)
    sd = float(1.4826 * np.nanmedian(np.abs(np.concatenate(changes))))
    return ChannelNoise(max(sd, sensor, least_sd(members, channel)), 0.0, float(np.median(pieces)), 0)


def _difference(first: Record, second: Record, channel: str, basis: Mapping[str, Channels]) -> np.ndarray:
    """(first - second) / sqrt(2) on the time base of `first`, which has the variance of a single record's noise."""
    a, b = basis[first.name][channel], basis[second.name][channel]
    known = np.isfinite(b)
    if known.sum() < 2:
        return np.full(a.shape, np.nan)
    return (a - at_times(first.time_s, second.time_s[known], b[known])) / np.sqrt(2)


def at_times(time_s: np.ndarray, measured_s: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Interpolate a repeat's samples to another's times; NaN before it begins and after it ends."""
    return np.interp(time_s, measured_s, samples, left=np.nan, right=np.nan)


def _moves(trial: Record, channel: str) -> np.ndarray:
    """Mask of the samples at which a record changes by much more than its fast noise within its `_WINDOW_S`."""
    samples, time_s, period = trial.channels[channel], trial.time_s, sample_period(trial.time_s)
    window_s = max(1, round(_WINDOW_S * _brevity(time_s) / period)) * period
    smooth = _smooth(samples)
    later, sooner = (np.interp(time_s + way * window_s, time_s, smooth) for way in (1, -1))
    least = 1e-12 * float(np.nanstd(samples))
    return np.abs(later - sooner) > _MOVING_SIGMAS * max(fast_noise(time_s, samples), least)


def _jitter(
    records: Sequence[tuple[np.ndarray, np.ndarray]],
    differences: Sequence[np.ndarray],
    moving: Sequence[np.ndarray],
    sds: Sequence[np.ndarray],
) -> float:
    """Timing jitter whose mean square effect explains the differences of fast-moving samples beyond `sds`."""
    parts = zip(differences, moving, sds, strict=True)
    excess = float(np.nansum([np.nansum(d[m] ** 2 - sd[m] ** 2) for d, m, sd in parts]))
    if excess <= 0 or not any(m.any() for m in moving):
        return 0.0

    def lacking(jitter_s: float) -> float:
        variances = (
            _shift_variance(time_s, samples, jitter_s, sd, m)
            for (time_s, samples), m, sd in zip(records, moving, sds, strict=True)
        )
        return float(excess - sum(np.nansum(variance) for variance in variances))

    longest_s = _LONGEST_JITTER_S * max(_brevity(time_s) for time_s, _ in records)
    if lacking(longest_s) > 0:
        return longest_s
    return float(brentq(lacking, 0.0, longest_s, xtol=2e-9 * longest_s))


def _brevity(time_s: np.ndarray) -> float:
    """The length of a record in seconds, but at most 1."""
    return min(float(time_s[-1] - time_s[0]), 1.0)


def _shift_variance(
    time_s: np.ndarray, samples: np.ndarray, jitter_s: float, sd: np.ndarray, where: np.ndarray | slice = slice(None)
) -> np.ndarray:
    """Mean square change of the samples `where` under a random shift in time, less that of the record's own noise."""
    known = np.isfinite(samples)
    if known.sum() < 2:
        return np.zeros(samples[where].shape)
    rising_s, seen, then_s, before = time_s[known], samples[known], time_s[where], samples[where]
    total = np.zeros(before.shape)
    for node, weight in zip(_SHIFT_NODES, _SHIFT_WEIGHTS, strict=True):
        total += weight * (np.interp(then_s + node * jitter_s, rising_s, seen) - before) ** 2
    return np.nan_to_num(np.maximum(total - sd[where] ** 2, 0.0))


def _smooth(samples: np.ndarray) -> np.ndarray:
    return median_filter(samples, size=3, mode="nearest")


def least_sd(trials: Sequence[Record], channel: str) -> float:
    """Lower bound of a floor: rounding, and 1e-4 of the channel's spread, so that no weight is infinite."""
    spread = max(float(np.nanstd(trial.channels[channel])) for trial in trials)
    rounded = max(_rounding_step(trial.channels[channel]) for trial in trials)
    return max(1e-4 * spread, rounded / np.sqrt(12.0)) or 1e-12


def _rounding_step(samples: np.ndarray) -> float:
    """Return the step to which a record was rounded, or 0. A record counts as rounded if its values recur and their
    differences are multiples of one step (to the decimals written), or if most samples equal their neighbours."""
    known = samples[np.isfinite(samples)]
    values = np.unique(known)
    steps = np.diff(values)
    steps = steps[steps > _SAME_VALUE * np.ptp(known)] if len(steps) else steps  # without rounding errors
    if len(steps) < 2:
        return 0.0
    single = float(np.mean(steps[steps < 1.5 * steps.min()]))  # a first estimate, refined with all steps
    step = float(steps.sum() / np.maximum(np.round(steps / single), 1.0).sum())
    written = _last_decimal(values)
    off_the_grid = np.abs(steps - np.round(steps / step) * step)
    near = max(_GRID_REL_TOL * step, written if written < step / 3.0 else 0.0)
    recur = len(steps) + 1 < _MAX_DISTINCT_SHARE * len(known) and bool((off_the_grid <= near).all())
    if recur:
        return step
    return float(steps.min()) if np.mean(np.diff(known) == 0.0) > 0.5 else 0.0


def _last_decimal(values: np.ndarray) -> float:
    """Return the power of ten to which values were rounded when written; 0 if they have too many digits for that."""
    largest = float(np.abs(values).max()) or 1.0
    for power in range(int(np.ceil(np.log10(largest))), int(np.floor(np.log10(_SAME_VALUE * largest))), -1):
        if np.allclose(values, np.round(values, -power), rtol=0.0, atol=_SAME_VALUE * largest):
            return float(10.0**power)
    return 0.0
