"""The signature of a residual: where it is and what it depends on, in words and numbers."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lacuna.check.numbers import within
from lacuna.diagnosis.drift import Drift
from lacuna.diagnosis.remainder import Remainder
from lacuna.estimation.fit import Fit

_BINS = 15
_WORTH_NAMING = 0.08  # share of the residual's mean square that a dependence must predict in other runs
_MOST_NAMED = 3
_VISIBLE = 4.0  # standard deviations under chance beyond which structure is listed
_SHARE_OF_LARGEST = 0.05


@dataclass(frozen=True)
class Dependence:
    """`share` of the residual variance that a curve over these quantities predicts in other runs."""

    experiment: str
    channel: str
    quantities: tuple[str, ...]
    share: float


@dataclass(frozen=True)
class Signature:
    """`experiments` with structure, worst first; quantities it `depends_on`, strongest first; `text`: a paragraph."""

    experiments: tuple[str, ...]
    depends_on: tuple[str, ...]
    dependences: tuple[Dependence, ...]
    text: str


def describe(fitted: Fit, remainder: Remainder, drifts: Sequence[Drift] = (), *, unshared: str = "") -> Signature:
    """Describe the residual of `fitted`, given its test for structure and the drifts over the session. `unshared`: a
    sentence on structure that repeats do not demonstrably share, or empty."""
    visible = {*remainder.found, *(key for key, z in remainder.z.items() if z > _VISIBLE)}
    least = _SHARE_OF_LARGEST * remainder.largest
    listed = (key for key in visible if remainder.shared[key] > least)
    places = sorted(listed, key=lambda key: (-remainder.shared[key], key))
    experiments = tuple(dict.fromkeys(experiment for experiment, _ in places))
    dependences = find_dependences(fitted, places[:4])
    depends_on = list(dict.fromkeys(q for d in dependences for q in d.quantities))[:_MOST_NAMED]
    if drifts:
        depends_on.append("order of the session")
    text = _sentence(places, remainder, dependences, drifts, unshared, fitted)
    return Signature(experiments, tuple(depends_on), tuple(dependences), text)


def find_dependences(fitted: Fit, keys: Iterable[tuple[str, str]]) -> list[Dependence]:
    """What the residual of `fitted` in each of these (experiment, channel) pairs depends on, where it does."""
    data = _gather(fitted)
    return [d for key in keys if key in data and (d := _dependence(key, data[key])) is not None]


_Rows = list[tuple[np.ndarray, Mapping[str, np.ndarray]]]


def _gather(fitted: Fit) -> dict[tuple[str, str], _Rows]:
    """By (experiment, channel), each trial's scaled residual and the quantities that it may depend on."""
    system = fitted.structure.system
    rows: dict[tuple[str, str], _Rows] = defaultdict(list)
    predictions = fitted.predictions()
    for trial, prediction, scaled in zip(
        fitted.problem.trials, predictions, fitted.problem.scaled(predictions), strict=True
    ):
        offered = system.regressors(trial, prediction)
        quantities = {name: np.nan_to_num(q) for name, q in offered.items() if q.shape == trial.time_s.shape}
        for channel, z in scaled.items():
            rows[trial.experiment, channel].append((np.clip(z, -50, 50), quantities))
    return rows


def _dependence(key: tuple[str, str], rows: _Rows) -> Dependence | None:
    """The quantity or pair whose binned mean over every other trial best predicts the rest; None if too little."""
    names = [n for n in rows[0][1] if all(n in quantities for _, quantities in rows)]
    if len(rows) < 2 or not names:  # without names the system offers nothing that a residual may depend on
        return None

    def best_of(sets: list[tuple[str, ...]]) -> tuple[tuple[str, ...], float]:
        shares = [_predicted_share(rows[::2], rows[1::2], one) for one in sets]
        return max(zip(sets, shares, strict=True), key=lambda one: one[1])

    found, share = best_of([(n,) for n in names])
    if pairs := [(*found, n) for n in names if n not in found]:
        pair, share_of_pair = best_of(pairs)
        if share_of_pair > share + _WORTH_NAMING:
            found, share = pair, share_of_pair
    return Dependence(*key, found, share) if share > _WORTH_NAMING else None


def _predicted_share(make: _Rows, check: _Rows, names: tuple[str, ...]) -> float:
    edges = [_edges(np.concatenate([q[n] for _, q in make])) for n in names]
    shape = tuple(len(e) + 1 for e in edges)
    total, count = np.zeros(shape), np.zeros(shape)
    for z, at in _placed(make, names, edges):
        np.add.at(total, at, z)
        np.add.at(count, at, 1)
    mean = total / np.maximum(count, 1)
    left = whole = 0.0
    for z, at in _placed(check, names, edges):
        left += float(((z - mean[at]) ** 2).sum())
        whole += float((z**2).sum())
    return 1 - left / max(whole, 1e-12)


def _edges(samples: np.ndarray) -> np.ndarray:
    levels = np.unique(samples)
    if len(levels) <= _BINS:
        return 0.5 * (levels[1:] + levels[:-1])
    return np.unique(np.quantile(samples, np.linspace(0, 1, _BINS + 1)[1:-1]))


def _placed(
    rows: _Rows, names: Sequence[str], edges: Sequence[np.ndarray]
) -> Iterator[tuple[np.ndarray, tuple[np.ndarray, ...]]]:
    """Measured residuals of each trial, and the cells they fall into."""
    for z, quantities in rows:
        known = np.isfinite(z)
        yield z[known], tuple(np.searchsorted(e, quantities[n][known]) for n, e in zip(names, edges, strict=True))


def _cannot_tell(remainder: Remainder, experiments: Sequence[str]) -> str:
    """A caveat where finding nothing does not show that nothing is missing; empty if there is none."""
    if not (most := remainder.cannot_tell):
        return ""
    each = ", ".join(f"{size:.1f} x the floor{within(e, experiments)}" for e, size in list(most.items())[:3])
    return (
        f" That does not prove that nothing is missing: up to {each} could not be distinguished from chance."
        " More repeats would narrow this down."
    )


def _sentence(
    places: Sequence[tuple[str, str]],
    remainder: Remainder,
    dependences: Sequence[Dependence],
    drifts: Sequence[Drift],
    unshared: str,
    fitted: Fit,
) -> str:
    repeated = any(noise.repeats for noise in fitted.problem.floor.channels.values())
    experiments = [t.experiment for t in fitted.problem.trials]
    if not places and not drifts and not unshared:
        known = "the differences between repeats" if repeated else "the noise"
        return f"The residual contains nothing beyond {known}.{_cannot_tell(remainder, experiments)}"
    parts = []
    if places:
        times = {place: np.sqrt(max(remainder.shared[place], 0)) for place in places[:4]}
        listed = ", ".join(f"{c}{within(e, experiments)} ({size:.1f} x the floor)" for (e, c), size in times.items())
        left = "Repeats share a residual" if repeated else "A residual is left"
        parts.append(f"{left} that the model does not explain: {listed}.")
    for d in dependences[:2]:
        parts.append(
            f"{100 * d.share:.0f} % of the residual variance of {d.channel}{within(d.experiment, experiments)} follows"
            f" {' and '.join(d.quantities)}."
        )
    if places and not dependences:
        parts.append("No single quantity of the model explains it.")
    if unshared:
        parts.append(unshared)
    if drifts:
        parts.append(
            f"{', '.join(d.parameter for d in drifts)} drift{'s' if len(drifts) == 1 else ''} over the session."
        )
    return " ".join(parts)
