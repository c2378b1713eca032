"""Is there anything left in a residual but noise? Structure is what repeats of a condition have in common.

The mean product of two repeats' residuals estimates the mean square of what they share: noise averages out
whatever its colour, because it is independent between runs. How large that mean gets by chance is found by
a bootstrap: every trial is replaced by a stretch of pure noise, taken from the differences between repeats,
in which everything shared cancels. No distribution, whiteness or known noise level is assumed.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from lacuna.diagnosis.policy import POLICY, Policy
from lacuna.estimation.noise import NoiseFloor, at_times
from lacuna.estimation.problem import FAILED, SOFT_LIMIT
from lacuna.system import Channels, Record, System, groups_of_repeats

_DRAWS = 200
_AT_ONCE = 2_000_000  # samples drawn at once, to bound memory
_TAIL = 0.1
_Z_95 = 1.645  # standard deviations: one-sided, 95 %
# Variance of the mean square over the floor's, in units of 2 / samples, if the floor is the median of the records' own
# fast noise: 4.4 to 5.1 in simulations of white noise, of which 1 is the mean square's.
_FAST_NOISE_VARIANCE = 5.0


@dataclass(frozen=True)
class Remainder:
    """The structure left in the residual of a fit.

    By (experiment, channel): `shared`, mean square of what repeats share, in units of the floor's variance; `z`, its
    excess in standard deviations of its distribution under chance; `chance`, the probability of a value as large by
    chance in any of the channels; `good_enough`, the value of `shared` that the declared accuracy permits; `sd`, the
    standard deviation of `shared` under chance. It matters if the mean over an experiment's channels exceeds
    `relevance` and is not due to chance.
    """

    shared: Mapping[tuple[str, str], float]
    z: Mapping[tuple[str, str], float]
    chance: Mapping[tuple[str, str], float]
    good_enough: Mapping[tuple[str, str], float]
    policy: Policy
    sd: Mapping[tuple[str, str], float] = field(default_factory=dict)

    @property
    def found(self) -> list[tuple[str, str]]:
        """The (experiment, channel) pairs with significant structure, largest first."""
        found = (key for key, p in self.chance.items() if p < self.policy.chance)
        return sorted(found, key=lambda key: -self.shared[key])

    @property
    def matters(self) -> bool:
        return self.worst > 1.0

    @property
    def largest(self) -> float:
        """The largest `shared` among the significant ones; 0 if there are none."""
        return max((self.shared[key] for key in self.found), default=0.0)

    @property
    def worst(self) -> float:
        """The remainder of the worst experiment with structure, as a multiple of `relevance`: it matters above 1."""
        places = [key for key in self.found if self.shared[key] > self.good_enough[key]]
        return max((self._mean(self.shared, e) / self.policy.relevance for e in {e for e, _ in places}), default=0.0)

    @property
    def cannot_tell(self) -> dict[str, float]:
        """Experiments in which something relevant may be missing though these trials do not show it, each with the
        upper confidence bound of its size (RMS, in floors), largest first. To conclude that nothing is missing, this
        bound has to lie below what matters (an equivalence test), not just the estimate."""
        found = {}
        for experiment in {e for e, _ in self.shared} if self.sd else ():
            most = {key: max(shared, 0.0) + _Z_95 * self.sd[key] for key, shared in self.shared.items()}
            mean = self._mean(most, experiment)
            if mean > self.policy.relevance:
                found[experiment] = float(np.sqrt(mean))
        return dict(sorted(found.items(), key=lambda one: -one[1]))

    def _mean(self, of: Mapping[tuple[str, str], float], experiment: str) -> float:
        """Mean over an experiment's channels; values within `good_enough` count as 0."""
        each = [v if v > self.good_enough[key] else 0.0 for key, v in of.items() if key[0] == experiment]
        return sum(each) / len(each)


def find_remainder(
    system: System,
    trials: Sequence[Record],
    scaled: Sequence[Channels],
    floor: NoiseFloor,
    *,
    policy: Policy = POLICY,
    seed: int = 0,
) -> Remainder:
    """Test the residuals `scaled` (in standard deviations of the floor, one mapping per trial) for structure."""
    draw = np.random.default_rng(seed)
    shared, z, alone, spread = {}, {}, {}, {}
    for key, conditions in _by_condition(trials, scaled).items():
        repeated = [rows for rows in conditions if _in_common(rows) > 0]
        single = [rows for rows in conditions if _in_common(rows) == 0]
        tests = [_of_repeats(repeated, draw)] if repeated else []
        if single:
            noise = floor.channels[key]
            is_fast_noise = not noise.repeats and noise.sd > system.sensor_noise(*key)
            tests.append(_of_singles(single, repeated, noise.samples_per_piece, is_fast_noise))
        sizes, zs, chances, sds = zip(*tests, strict=True)
        spread[key] = max(sds)
        shared[key] = float(np.average(sizes, weights=[len(part) for part in (repeated, single) if part]))
        z[key], alone[key] = max(zs), min(1.0, len(tests) * min(chances))
    chance = {key: float(-np.expm1(len(z) * np.log1p(-min(p, 0.999)))) for key, p in alone.items()}
    good_enough = {key: float(_compressed(system.accuracy(*key) / floor.channels[key].sd)) ** 2 for key in shared}
    return Remainder(shared, z, chance, good_enough, policy, spread)


def _of_repeats(conditions: Sequence[np.ndarray], draw: np.random.Generator) -> tuple[float, float, float, float]:
    """For repeated conditions: `shared`, its z-score, its probability by chance, and its standard deviation then."""
    shared, by_chance = _shared(conditions), _null_distribution(conditions, draw)
    z = (shared - by_chance.mean()) / max(by_chance.std(), 1e-12)
    return shared, float(z), _exceeded(by_chance, shared), float(by_chance.std())


def _of_singles(
    conditions: Sequence[np.ndarray], repeated: Sequence[np.ndarray], samples_per_piece: float, is_fast_noise: bool
) -> tuple[float, float, float, float]:
    """The same for conditions run once, from the mean square above the floor. The variance includes that of the floor,
    which is known only as well as the repeats, or the fast noise of these same samples, allow."""
    samples = np.concatenate([rows[np.isfinite(rows)] for rows in conditions])
    above = float(np.mean(samples**2) - 1)
    of_floor = sum((len(rows) - 1) * _in_common(rows) for rows in repeated)
    of_samples = (_FAST_NOISE_VARIANCE if is_fast_noise else 1.0) / len(samples)
    variance = 2 * samples_per_piece * (of_samples + (1 / of_floor if of_floor else 0.0))
    z = above / np.sqrt(variance)
    return above, float(z), float(ndtr(-z)), float(np.sqrt(variance))


def _by_condition(trials: Sequence[Record], scaled: Sequence[Channels]) -> dict[tuple[str, str], list[np.ndarray]]:
    """By (experiment, channel), one array of shape (repeats, samples) for each condition, holding the repeats that have
    the channel, on the time base of the first of them; NaN where nothing was measured."""
    found: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    z = dict(zip((trial.name for trial in trials), scaled, strict=True))
    for members in groups_of_repeats(trials):
        for channel in dict.fromkeys(c for t in members for c in z[t.name]):
            having, rows = [t for t in members if channel in z[t.name]], []
            for trial in having:
                measured, residual = np.isfinite(trial.channels[channel]), z[trial.name][channel]
                # what the model could not predict is penalized, and what is large compressed, as in a fit
                penalized = np.where(measured & ~np.isfinite(residual), FAILED, residual)
                rows.append(_compressed(at_times(having[0].time_s, trial.time_s, penalized)))
            found[having[0].experiment, channel].append(np.array(rows))
    return found


def _compressed(z: np.ndarray | float) -> np.ndarray:
    return SOFT_LIMIT * np.arcsinh(np.divide(z, SOFT_LIMIT))


def _in_common(rows: np.ndarray) -> float:
    """Average number of samples that two repeats have in common."""
    if len(rows) < 2:
        return 0.0
    known = np.isfinite(rows).sum(axis=0)
    return float((known * (known - 1)).sum()) / (len(rows) * (len(rows) - 1))


def _shared(conditions: Sequence[np.ndarray]) -> float:
    """Mean product of different repeats at the same sample."""
    total, count = 0.0, 0
    for rows in conditions:
        repeats, known = len(rows), np.nan_to_num(rows)
        squares = float((known.sum(axis=0) ** 2).sum()) - float((known**2).sum())
        total += squares / (2 * _in_common(rows))
        count += repeats * (repeats - 1) // 2
    return total / count


def _null_distribution(conditions: Sequence[np.ndarray], draw: np.random.Generator) -> np.ndarray:
    """Draw `_shared` of noise alone, `_DRAWS` times, from noise traces with random sign, order and time shift."""
    differences = [(rows[a] - rows[b]) / np.sqrt(2) for rows in conditions for a in range(len(rows)) for b in range(a)]
    noise = [known for known in (d[np.isfinite(d)] for d in differences) if known.size]
    total, count = np.zeros(_DRAWS), 0
    for rows in conditions:
        repeats, length = rows.shape
        most, in_common = max(1, _AT_ONCE // rows.size), _in_common(rows)
        for first in range(0, _DRAWS, most):
            drawn = _stretches(noise, (min(most, _DRAWS - first), repeats, length), draw) * np.isfinite(rows)
            squares = (drawn.sum(axis=1) ** 2).sum(axis=1) - (drawn**2).sum(axis=(1, 2))
            total[first : first + most] += squares / (2 * in_common)
        count += repeats * (repeats - 1) // 2
    return total / count


def _exceeded(draws: np.ndarray, value: float) -> float:
    """Probability that chance exceeds `value`, with an exponential tail fitted to the largest tenth of the draws: what
    walks share by chance is far from normal, since each has few independent errors."""
    threshold = float(np.quantile(draws, 1 - _TAIL))
    if value <= threshold:
        return float(np.mean(draws >= value))
    excess = draws[draws > threshold] - threshold
    mean = float(excess.mean()) if excess.size else 0.0  # no excess if repeats are identical
    return _TAIL * float(np.exp(-(value - threshold) / max(mean, 1e-12)))


def _stretches(noise: Sequence[np.ndarray], shape: tuple[int, ...], draw: np.random.Generator) -> np.ndarray:
    """Rows of noise: each a randomly drawn trace, circularly shifted by a random amount, with a random sign."""
    *rows, length = shape
    chosen = draw.integers(len(noise), size=rows)
    place = draw.integers(np.array([len(trace) for trace in noise])[chosen])
    round_again = [np.resize(trace, len(trace) + length) for trace in noise]
    found = np.empty(shape)
    for row in np.ndindex(*rows):
        found[row] = round_again[chosen[row]][place[row] : place[row] + length]
    return found * draw.choice((-1.0, 1.0), (*rows, 1))
