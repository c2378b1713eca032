"""Checks of models that cannot be fitted, by what they return, raise, ignore or remember."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from lacuna.check.given import gaps_in_inputs
from lacuna.check.numbers import SAME, changed, differ, spread
from lacuna.errors import LacunaError, MisuseError, listed
from lacuna.records import Stretch
from lacuna.system import Channels, Effect, Record, System, Theta, misshapen, no_prediction

_MAX_CHANGE = 1e-3  # of a channel's spread, RMS: largest permitted change by an effect at its absent size
_MAX_CHANGE_ELSEWHERE = 0.03  # the same for an effect of typical size in an experiment outside its `experiments`
_NEAR_ABSENT = 0.1  # of its typical size: an effect's bounds must let it come this close to its absent size


def initial(system: System) -> dict[str, float]:
    """The base model's initial values."""
    return {p.name: p.value for p in system.parameters}


def check_model(system: System, trials: Sequence[Record]) -> tuple[dict[str, Channels], tuple[str, ...]]:
    """Check the model. Returns its predictions at the initial values, by the names of the trials that it can predict,
    and warnings. Raises MisuseError."""
    start = initial(system)
    predictions = {t.name: predicted(system, start, (), t) for t in trials}
    failed = [t.name for t in trials if _failing(t, predictions[t.name]) is not None]
    if len(failed) == len(trials):
        why = next(iter(gaps_in_inputs(trials)), "Choose values that can be simulated.")
        raise MisuseError(
            f"trial {failed[0]}, channel {_failing(trials[0], predictions[failed[0]])}: the prediction is NaN, as in"
            f" every trial, with the parameters at their initial values. {why}"
        )
    good = [t for t in trials if t.name not in failed]
    if name := changed(predicted(system, start, (), good[0]), predictions[good[0].name], good[0], SAME):
        raise MisuseError(
            f"trial {good[0].name}, channel {name}: two predictions with the same parameters differ."
            " The model must not draw random numbers or keep state between calls."
        )
    _check_free_run(system, start, good[0], predictions)
    for trial in good:
        system.regressors(trial, predictions[trial.name])
    _check_effects(system, start, good, predictions)
    for offer in system.candidate_experiments():
        predicted(system, start, (), offer.trial)
    warnings = (
        [f"With its parameters at their initial values the model cannot predict {listed(failed)}."] if failed else []
    )
    never_off = [*_never_off(system), *_unused(system, start, good, predictions)]
    idle = _idle(system, start, good, predictions)
    if idle and len(idle) == len(system.parameters):
        why = " ".join(never_off) or "Does the model use any of them?"
        raise MisuseError(
            f"trial {good[0].name}, channel {next(iter(good[0].channels))}: no parameter changes the prediction. {why}"
        )
    warnings += never_off
    if idle:
        warnings.append(f"{listed(idle)} {'does' if len(idle) == 1 else 'do'} not affect any prediction.")
    return {t.name: predictions[t.name] for t in good}, tuple(warnings)


def _expected(system: System, trial: Record) -> dict[str, float]:
    """Expected values of a trial's nuisances."""
    return {p.name: p.value for p in system.nuisances(trial)}


def predicted(system: System, theta: Theta, effects: tuple[str, ...], trial: Record) -> Channels:
    """A prediction of a trial at its nuisances' expected values, checked. Raises MisuseError."""
    theta = dict(theta) | _expected(system, trial)
    try:
        found = system.predict(theta, effects, trial)
    except LacunaError:
        raise
    except (ArithmeticError, np.linalg.LinAlgError):  # the values are too extreme to simulate
        return no_prediction(trial)
    except Exception as error:
        raise MisuseError(
            f"trial {trial.name}, channel {listed(list(trial.channels))}: the model{_with(effects)} raises"
            f" {type(error).__name__}: {error}"
        ) from error
    if fault := misshapen(found, trial):
        raise MisuseError(f"trial {trial.name}, {fault}{_with(effects)}.")
    return {name: np.array(found[name], float) for name in trial.channels}


def _check_free_run(system: System, start: Theta, trial: Record, predictions: Mapping[str, Channels]) -> None:
    """Raise MisuseError if late samples of a channel, which give no initial state, change its prediction."""
    theta = dict(start) | _expected(system, trial)
    for name, measured in trial.channels.items():
        (found,) = system.predict_trials([theta], (), [_measured_otherwise(trial, name)])
        if differ(found[name], predictions[trial.name][name], SAME * spread(measured)):
            raise MisuseError(
                f"trial {trial.name}, channel {name}: the prediction depends on the measured samples, which would hide"
                " anything missing. Let the model run freely, from its initial state and its inputs."
            )


def _measured_otherwise(trial: Record, name: str) -> Record:
    """`trial` with altered samples of a channel in its second half, also in the run that it is a stretch of, if any."""
    measured, late = trial.channels[name], np.arange(len(trial.time_s)) >= len(trial.time_s) // 2
    otherwise = (measured + late * (1.0 + spread(measured))).astype(measured.dtype)
    stretch = trial.payload
    if isinstance(stretch, Stretch):
        stretch = replace(stretch, run=_measured_otherwise(stretch.run, name))
    return replace(trial, channels={**trial.channels, name: otherwise}, payload=stretch)


def _check_effects(system: System, start: Theta, trials: Sequence[Record], predictions: Mapping[str, Channels]) -> None:
    """Raise MisuseError if an effect at its absent size changes the base model's prediction, or at its typical size
    changes it noticeably in an experiment outside its `experiments`, or if no fit with it could start."""
    firsts = {t.experiment: t for t in reversed(trials)}
    for name, effect in system.effects.items():
        off = effect.typical | dict.fromkeys(effect.size_names, effect.absent)
        for trial in firsts.values():
            if effect.shows_in(trial):
                theta, share, why = off, _MAX_CHANGE, f"its size is {effect.absent:g}, at which it is declared absent."
            else:
                theta, share = effect.typical, _MAX_CHANGE_ELSEWHERE
                why = f"{trial.experiment} is not among its `experiments`: add it."
            found = predicted(system, dict(start) | theta, (name,), trial)
            if channel := changed(found, predictions[trial.name], trial, share):
                raise MisuseError(
                    f"trial {trial.name}, channel {channel}: effect {name} changes the prediction although {why}"
                )
        _check_start_sizes(system, start, effect, [t for t in trials if effect.shows_in(t)])


def _check_start_sizes(system: System, start: Theta, effect: Effect, seen: Sequence[Record]) -> None:
    """Raise MisuseError if an effect can be simulated in no trial at any of the sizes at which fits start: the search
    would say that it does not help. One trial is simulated, unless all sizes fail in it."""
    sizes, first = _start_sizes(effect, effect.start_factors), ""
    for trial in seen:
        causes = [_failure(system, {**start, **effect.typical, **size}, effect, trial) for size in sizes]
        if not all(causes):
            return
        first = first or f"trial {trial.name}: {causes[0]}"
    if first:
        tried = ("; ".join(f"{n} = {system.told(n, v):.4g}" for n, v in size.items()) for size in sizes)
        raise MisuseError(
            f"effect {effect.name} cannot be simulated at any of the sizes at which fits start"
            f" ({listed(tried, len(sizes))}): {first}. Correct the model, or declare another typical size."
        )


def _failure(system: System, theta: Theta, effect: Effect, trial: Record) -> str:
    """Why a trial cannot be simulated at all with an effect; empty if it can. Raises MisuseError, as `_attempted`."""
    found = _attempted(system, theta, (effect.name,), trial)
    if isinstance(found, str):
        return found
    known = any((np.isfinite(found[c]) & np.isfinite(measured)).any() for c, measured in trial.channels.items())
    return "" if known else "the prediction is NaN"


def _attempted(system: System, theta: Theta, effects: tuple[str, ...], trial: Record) -> Channels | str:
    """A prediction of a trial away from the initial values, or why it fails. Raises MisuseError for one of the wrong
    shape: a slip, since these values are not extreme."""
    found = system.attempt({**theta, **_expected(system, trial)}, effects, trial)
    if not isinstance(found, str) and (fault := misshapen(found, trial)):
        raise MisuseError(f"trial {trial.name}, {fault}{_with(effects)}.")
    return found


def _with(effects: tuple[str, ...]) -> str:
    return f" with effect {effects[0]}" if effects else ""


def _start_sizes(effect: Effect, factors: Iterable[float]) -> list[dict[str, float]]:
    """Sizes of an effect at these multiples of its typical ones, of either sign where its bounds allow."""
    sized = effect.parameters[: effect.sizes]
    signs = (1.0, -1.0) if all(p.lower < effect.absent < p.upper for p in sized) else (1.0,)
    return [
        {
            effect.full_name(p): min(max(effect.absent + sign * by * (p.value - effect.absent), p.lower), p.upper)
            for p in sized
        }
        for sign in signs
        for by in factors
    ]


def _never_off(system: System) -> list[str]:
    """Warnings of effects that their bounds keep away from their absent size, such as a factor not absent at 1."""
    found = []
    for effect in system.effects.values():
        for p in effect.parameters[: effect.sizes]:
            away = max(p.lower - effect.absent, effect.absent - p.upper)
            if away > _NEAR_ABSENT * abs(p.value - effect.absent):
                name = effect.full_name(p)
                absent, *bounds = (system.told(name, value) for value in (effect.absent, p.lower, p.upper))
                found.append(
                    f"Effect {effect.name} is declared absent when its {p.name} is {absent:g}, but the bounds"
                    f" {min(bounds):g} to {max(bounds):g} keep it away from there. If another value makes it absent,"
                    " declare that (for a factor: absent=1)."
                )
    return found


def _unused(system: System, start: Theta, trials: Sequence[Record], predictions: Mapping[str, Channels]) -> list[str]:
    """A warning of the effects that change no prediction at any of the sizes at which fits start, if there are any."""
    unused = []
    for name, effect in system.effects.items():
        sizes = _start_sizes(effect, (1.0, *effect.start_factors))
        seen = (t for t in trials if effect.shows_in(t))
        if not any(
            changed(
                predict_unchecked(system, dict(start) | effect.typical | size, (name,), t), predictions[t.name], t, 0.0
            )
            for t in seen
            for size in sizes
        ):
            unused.append(name)
    if not unused:
        return []
    which, it = (
        (f"Effect {unused[0]} changes", "it") if len(unused) == 1 else (f"Effects {', '.join(unused)} change", "them")
    )
    return [
        f"{which} no prediction at any of the start sizes: does the model use {it}, and do these records excite {it}?"
    ]


def predict_unchecked(system: System, theta: Theta, effects: tuple[str, ...], trial: Record) -> Channels:
    """A prediction as the search makes it, at values that may be extreme; a failed one (NaN) counts as a change."""
    theta = dict(theta) | _expected(system, trial)
    return system.predict_trials([theta], effects, [trial])[0]


def _idle(system: System, start: Theta, trials: Sequence[Record], predictions: Mapping[str, Channels]) -> list[str]:
    """Base parameters that change no trial's prediction."""
    idle = []
    for p in system.parameters:
        step = p.step_scale if p.value + p.step_scale <= p.upper else -p.step_scale
        moved = dict(start) | {p.name: min(max(p.value + step, p.lower), p.upper)}
        touched = (t for t in trials if system.matters(p.name, t))
        tried = ((t, _attempted(system, moved, (), t)) for t in touched)
        if not any(isinstance(found, str) or changed(found, predictions[t.name], t, 0.0) for t, found in tried):
            idle.append(p.name)
    return idle


def _failing(trial: Record, prediction: Channels) -> str | None:
    """The first channel whose prediction is missing at a measured sample, or None."""
    return next((c for c, p in prediction.items() if not np.isfinite(p[np.isfinite(trial.channels[c])]).all()), None)
