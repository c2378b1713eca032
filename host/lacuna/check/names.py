"""Checks of names: undefined, inconsistent or ambiguous ones are rejected."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from lacuna.errors import MisuseError, TooLittleDataError
from lacuna.system import Record, System

_FEWEST_TRIALS = 3


def check_names(system: System, trials: Sequence[Record]) -> None:
    if len(trials) < _FEWEST_TRIALS:
        raise TooLittleDataError(
            f"{len(trials)} trial{'' if len(trials) == 1 else 's'} given: a diagnosis needs at least {_FEWEST_TRIALS},"
            " two for fitting and one for selection. One long record can be cut up: lacuna.windows, lacuna.segments."
        )
    for name in _repeated(t.name for t in trials):
        raise MisuseError(f"trial {name}: more than one trial has this name; names must be unique.")
    for key, effect in system.effects.items():
        if key != effect.name:
            raise MisuseError(f"effect {effect.name} is listed under the key {key}: use its name as the key.")
        for site in effect.freed_at:
            if site not in system.correction_sites:
                raise MisuseError(f"effect {effect.name} is freed at {site}, which is not a correction site.")
        for parameter in system.parameters:  # those with known values are not among them
            if parameter.name in effect.apart and parameter.at_least is None:
                raise MisuseError(
                    f"effect {effect.name} declares {parameter.name} in `apart`, but that parameter has no `at_least`"
                    " to be kept apart from."
                )
    effects = [e.full_name(p) for e in system.effects.values() for p in (*e.parameters, *e.own)]
    for name in _repeated([p.name for p in system.parameters] + effects):
        raise MisuseError(f"parameter {name}: more than one has this name; names must be unique.")
    for trial in trials:
        names = [p.name for p in system.nuisances(trial)]
        for name in _repeated(names + [p.name for p in system.parameters]):
            raise MisuseError(f"trial {trial.name}: its nuisance {name} has the name of another parameter.")


def _repeated(names: Iterable[str]) -> list[str]:
    return [name for name, count in Counter(names).items() if count > 1]
