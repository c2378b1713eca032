"""Draw a set of some kind from its seed: what its owner has, and separately the truth."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.small.decoys import DECOYS, effect_of
from benchmarks.small.distinct import left_by, tellable
from benchmarks.small.excitation import SHAPES, shaped
from benchmarks.small.instrument import Instrument
from benchmarks.small.kind import Form, Kind
from benchmarks.small.kinds import KINDS
from benchmarks.small.offered import Offered, OfferedModel, OfferedRun
from lacuna import Effect, Parameter

TOLD = Path(__file__).with_name("told.json")  # by truth and seed, the first decidable draw
TRUTHS = ("single", "none", "outside", "pair", "decoys")
MANY = 20  # decoys
_ATTEMPTS = 200
_NOISES = (2.5, 6.0)  # error of the base model at its best, in noises
_SHARES = (1e-3, 3e-2)  # allowed noise, as a share of the output's spread
_STRIDE = 3  # through a kind's forms


class UntellableError(Exception):
    """No decidable set was drawn for this job."""


@dataclass(frozen=True)
class UnseenRun:
    """A run that nobody is given, without noise, to compare predictions with."""

    name: str
    time_s: np.ndarray
    applied: np.ndarray
    clean: np.ndarray


@dataclass(frozen=True)
class Sealed:
    """The truth of a set: names of the `effects` that are present (`offered`: those on offer), their formulas and
    values with the base's, how it was measured, and runs that nobody has seen."""

    effects: tuple[str, ...]
    offered: tuple[str, ...]
    formulas: tuple[str, ...]
    values: Mapping[str, float]
    instrument: Instrument
    repeats: int
    judged: tuple[UnseenRun, ...]


def drawn(truth: str, seed: int) -> tuple[Offered, Sealed]:
    """Draw the set of this seed, the same on every call. `truth`: "single", "none", "outside" (one effect, not on
    offer), "pair", or "decoys" (twenty absent ones, beside one effect or none). Raises UntellableError."""
    attempt = which(truth, seed)
    found = one_draw(truth, seed, attempt, tellable=lambda *given: True)
    if found is None:
        raise UntellableError(f"{truth} {seed}: draw {attempt} is not what it was when it was found decidable")
    return found


def which(truth: str, seed: int) -> int:
    """The first decidable draw of a seed: looked up if known, since finding it takes many fits. Raises
    UntellableError."""
    known = _told().get(f"{truth} {seed}")
    return sought(truth, seed) if known is None else known


def sought(truth: str, seed: int) -> int:
    """Find the first decidable draw by trying. Raises UntellableError."""
    for attempt in range(_ATTEMPTS):
        if one_draw(truth, seed, attempt, tellable):
            return attempt
    raise UntellableError(f"{truth} {seed} ({_kind(seed).key}): no decidable set in {_ATTEMPTS} draws")


@cache
def _told() -> dict[str, int]:
    return json.loads(TOLD.read_text(encoding="utf-8"))


def _kind(seed: int) -> Kind:
    return list(KINDS.values())[seed % len(KINDS)]


def one_draw(truth: str, seed: int, attempt: int, tellable: Callable[..., bool]) -> tuple[Offered, Sealed] | None:
    """Draw attempt number `attempt`; None if it is not decidable."""
    draw = np.random.default_rng([seed, TRUTHS.index(truth), attempt])
    kind, turn, key = _kind(seed), seed // len(KINDS), f"{truth} {seed}"
    forms = _forms(truth, kind, turn, draw)
    effects = tuple(form.effect for form in forms)
    values = _values(kind, forms, draw)
    instrument, repeats = _instrument(draw), int(draw.choice([1, 2, 3, 3]))
    conditions = _conditions(kind, repeats, instrument, draw)
    clean = [kind.truth(t, u, values) for _, t, u in conditions]
    spread = float(np.std(np.concatenate(clean)))
    if not np.isfinite(spread):
        return None
    empty = _offered(truth, kind, effects, conditions, spread, draw, key)
    if instrument.drifts:
        empty = replace(empty, nuisances=_drift(1.0), options={})
    base = left_by(empty, clean)
    noise = base / _between(draw, _NOISES) if effects else spread * _between(draw, _SHARES)
    if not _SHARES[0] <= noise / spread <= _SHARES[1] or (not effects and base > 0.2 * noise):
        return None
    instrument = replace(instrument, noise=noise)
    if effects and not tellable(empty, clean, effects, base, noise):
        return None
    offered = replace(
        empty,
        nuisances=_drift(float(f"{instrument.drifts * noise:.1g}")) if instrument.drifts else (),
        options=_options(kind, instrument, repeats, draw),
        runs=_measured(conditions, clean, instrument, repeats, draw),
    )
    on_offer = tuple(e for e in effects if e in {o.name for o in offered.effects})
    formulas = tuple(form.formula for form in forms)
    return offered, Sealed(effects, on_offer, formulas, values, instrument, repeats, _judged(kind, values, draw))


def _between(draw: np.random.Generator, ends: tuple[float, float]) -> float:
    return float(np.exp(draw.uniform(*np.log(ends))))


def _forms(truth: str, kind: Kind, turn: int, draw: np.random.Generator) -> tuple[Form, ...]:
    """The forms that are present, taken in turn so that a kind's forms come up equally often."""
    first = kind.forms[_STRIDE * turn % len(kind.forms)]
    if truth == "none" or (truth == "decoys" and turn % 2):
        return ()
    if truth != "pair":
        return (first,)
    others = [form for form in kind.forms if form.effect != first.effect]
    return first, others[draw.integers(len(others))]


def _values(kind: Kind, forms: Sequence[Form], draw: np.random.Generator) -> dict[str, float]:
    """True values: of the base around its declared values, of the forms within their ranges."""
    base = {p.name: p.value * float(np.exp(0.2 * draw.standard_normal())) for p in kind.parameters}
    return base | {name: _between(draw, ends) for form in forms for name, ends in form.ranges.items()}


def _instrument(draw: np.random.Generator) -> Instrument:
    """Draw an instrument; each fault occurs in some sets."""
    return Instrument(
        noise=1.0,
        colored=float(draw.uniform(1.5, 5.0)) * (draw.random() < 0.3),
        rounds=float(draw.choice([0.5, 1.5, 4.0])) * (draw.random() < 0.35),
        drifts=float(draw.uniform(1.5, 4.0)) * (draw.random() < 0.25),
        gaps=bool(draw.random() < 0.25),
        uneven=bool(draw.random() < 0.25),
    )


def _conditions(kind: Kind, repeats: int, instrument: Instrument, draw: np.random.Generator):
    """(name, times, input) of each condition: four if they are repeated, else eight."""
    shapes = tuple(SHAPES) if repeats == 1 else tuple(draw.choice(tuple(SHAPES), 2, replace=False))
    found = []
    for shape in shapes:
        for size in kind.sizes:
            time_s = instrument.times(kind.duration_s, kind.samples, draw)
            found.append((f"{shape} {size:g}", time_s, _applied(kind, shape, size, time_s, draw)))
    return found


def _applied(kind: Kind, shape: str, size: float, time_s: np.ndarray, draw: np.random.Generator) -> np.ndarray:
    return np.maximum(kind.bias + size * shaped(str(shape), time_s, kind.duration_s, draw), kind.least)


def _offered(truth: str, kind: Kind, effects, conditions, spread: float, draw, key: str) -> Offered:
    """The owner's declaration, with guessed values, and runs yet to be measured."""
    guess = float(f"{spread:.1g}")
    own, decoys = _candidates(truth, kind, effects, draw)
    return Offered(
        key=key,
        model=OfferedModel(kind.key, tuple(e.name for e in decoys), guess),
        parameters=tuple(_guessed(p, 0.25, draw) for p in kind.parameters),
        effects=tuple(replace(e, parameters=tuple(_guessed(p, 0.4, draw) for p in e.parameters)) for e in own) + decoys,
        nuisances=(),
        runs=tuple(OfferedRun(name, name, t, u, np.full(len(t), np.nan)) for name, t, u in conditions),
    )


def _candidates(truth: str, kind: Kind, effects, draw) -> tuple[tuple[Effect, ...], tuple[Effect, ...]]:
    """Candidates: three to eight of the kind's own in random order, including those present unless withheld; or
    twenty absent ones and those present."""
    there = [e for e in kind.effects if e.name in effects and truth != "outside"]
    others = [e for e in kind.effects if e.name not in effects]
    others = [others[k] for k in draw.permutation(len(others))]
    if truth != "decoys":
        count = int(draw.integers(3, min(8, len(others) + len(there)) + 1))
        own = there + others[: max(count - len(there), 1)]
        return tuple(own[k] for k in draw.permutation(len(own))), ()
    own = there + others[:6]
    rest = [list(DECOYS)[k] for k in draw.permutation(len(DECOYS))][: MANY - len(others[:6])]
    return tuple(own[k] for k in draw.permutation(len(own))), tuple(effect_of(name) for name in rest)


def _guessed(p: Parameter, by: float, draw: np.random.Generator) -> Parameter:
    """The parameter with a poorly known declared value, to two digits."""
    value = float(f"{p.value * np.exp(by * draw.standard_normal()):.2g}")
    return replace(p, value=float(np.clip(value, p.lower, p.upper)))


def _drift(scale: float) -> tuple[Parameter, ...]:
    return tuple(Parameter(name, "", 0.0, -20.0 * scale, 20.0 * scale, scale=scale) for name in ("zero", "slope"))


def _options(kind: Kind, instrument: Instrument, repeats: int, draw: np.random.Generator) -> dict:
    """What owners know of their instrument: some know its noise from the data sheet, and some of those without
    repeats know that the noise is colored, or its correlation time."""
    options = {}
    declared, how = draw.random() < 0.3, draw.random()
    if declared:
        options["sensor_noise"] = {kind.output: float(f"{0.8 * instrument.noise:.1g}")}
    if instrument.colored and repeats == 1:
        seconds = instrument.colored * kind.duration_s / kind.samples
        options["noise_time_s"] = {kind.output: float(f"{seconds:.1g}")} if how < 0.5 else "estimated"
    return options


def _measured(
    conditions, clean, instrument: Instrument, repeats: int, draw: np.random.Generator
) -> tuple[OfferedRun, ...]:
    return tuple(
        OfferedRun(f"{name}, run {run}" if repeats > 1 else name, name, t, u, instrument.measured(y, t, draw))
        for (name, t, u), y in zip(conditions, clean, strict=True)
        for run in range(1, repeats + 1)
    )


def _judged(kind: Kind, values: Mapping[str, float], draw: np.random.Generator) -> tuple[UnseenRun, ...]:
    """Two runs under conditions that nobody is given, one of them larger than any other."""
    time_s = np.arange(kind.samples) * (kind.duration_s / kind.samples)
    found = []
    for shape, size in zip(("multisine", "steps"), kind.judged, strict=True):
        applied = _applied(kind, shape, size, time_s, draw)
        found.append(UnseenRun(f"{shape} {size:g}", time_s, applied, kind.truth(time_s, applied, values)))
    return tuple(found)
