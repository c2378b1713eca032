"""A system from a plain function: `lacuna.System(simulate, parameters=[...], effects=[...])`."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Collection, Hashable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from lacuna.coordinates import PLAIN, Coordinate, of_effect, of_parameter
from lacuna.errors import DeclarationError, LacunaError, MisuseError
from lacuna.held import Held
from lacuna.records import Stretch
from lacuna.system import (
    LEARNT,
    CandidateExperiment,
    Channels,
    Correction,
    CorrectionSite,
    Effect,
    Parameter,
    Record,
    System,
    Theta,
    check_hashable,
    middle_conditions,
    several,
)
from lacuna.values import Values

ESTIMATED = "estimated"
_ONE_AT_A_TIME = threading.Lock()

Simulate = Callable[[Record, Values], Any]


class Curve:
    """The curve learnt at a site, as a function of its variable: 0 everywhere until it has been learnt."""

    def __init__(self, site: CorrectionSite, table: np.ndarray | None = None):
        self._at = np.linspace(site.lower, site.upper, 2 if table is None else table.shape[1])
        self.rows = np.zeros((len(site.rows), 2)) if table is None else table

    def __call__(self, variable: Any, row: int = 0) -> Any:
        return np.interp(variable, self._at, self.rows[row])


class FunctionSystem(System):
    """A model given as a function, with the candidate effects that it may lack.

    `simulate(record, theta)` simulates one record as a free run: from its initial state and its inputs, never from
    measured outputs. `record["force_N"]` is a column, shape (n,), or a single value of the record; `record.time_s` are
    its times. `theta.mass_kg` is a parameter of the base model, `theta.coulomb.force_N` one of an effect; while the
    effect is off, its size has the value at which it is absent. `theta` holds the parameters in the order in which they
    are declared here. `simulate` returns the predicted outputs by name, each of shape (n,); a single output may be a
    bare array. It is called from several threads.

    `parameters`: the `Parameter`s of the base model. `effects`: the `Effect`s that it may lack. A single parameter,
    effect, nuisance, curve or experiment needs no brackets. All other arguments are optional:

    - `outputs`: names of the columns that `simulate` predicts; all others are its inputs. Needed if it returns bare
      arrays and records have more than one column apart from time.
    - `nuisances`: quantities that differ from run to run, such as an initial state that is not exactly known:
      `Parameter`s, or a function of the record that returns them. `theta` has them under their own names.
    - `regressors`: quantities that a residual may depend on: a function of (record, prediction) that returns arrays by
      name. By default the outputs, their rates and directions of change, the inputs, and time.
    - `sensor_noise`: standard deviation of the instrument's noise, by output, in its unit.
    - `accuracy`: RMS error up to which a prediction is good enough whatever the noise, by output, in its unit.
    - `noise_time_s`: for records without repeats, the correlation time of the noise in seconds, by output or for all;
      "estimated" takes it from the residual of a first diagnosis. By default only the fast noise of a record counts as
      noise.
    - `curves`: `CorrectionSite`s at which a curve may be learnt if no effect explains the records; `simulate` evaluates
      it as `theta.NAME(x)`.
    - `experiments`: `CandidateExperiment`s that could be run next.
    - `spare`: conditions that are never fitted, so that they can judge; () for none. By default the middle condition of
      every experiment with three or more repeated ones.
    - `fixed`: values, by name, of parameters that are known and not fitted. `tied`: for a parameter that always equals
      another one, the name of that one. Both apply to parameters of the base model and to those that shape an effect
      (`coulomb.speed_m_s`), not to those that set its size.

    Raises DeclarationError if the declaration contradicts itself.
    """

    nuisances_per_run = True
    tells_of_all = True

    def __init__(
        self,
        simulate: Simulate,
        parameters: Iterable[Parameter] | Parameter,
        effects: Iterable[Effect] | Effect = (),
        *,
        outputs: Sequence[str] | str = (),
        name: str = "",
        nuisances: Iterable[Parameter] | Parameter | Callable[[Record], Iterable[Parameter] | Parameter] = (),
        regressors: Callable[[Record, Channels], Mapping[str, np.ndarray]] | None = None,
        sensor_noise: Mapping[str, float] | None = None,
        accuracy: Mapping[str, float] | None = None,
        noise_time_s: Mapping[str, float] | float | str = 0.0,
        curves: Iterable[CorrectionSite] | CorrectionSite = (),
        experiments: Iterable[CandidateExperiment] | CandidateExperiment = (),
        spare: Iterable[Hashable] | None = None,
        fixed: Mapping[str, float] | None = None,
        tied: Mapping[str, str] | None = None,
    ):
        self.simulate, self.name = simulate, name or getattr(simulate, "__name__", "system")
        self.outputs = (outputs,) if isinstance(outputs, str) else tuple(outputs)
        self.trials: tuple[Record, ...] = ()
        self._last: Any = None  # what `simulate` returned last
        self._refills = False
        given, library, sites = several(parameters, Parameter), _library(effects), several(curves, CorrectionSite)
        _check_names([p.name for p in given], "parameter")
        _check_names([e.name for e in library], "effect")
        _check_names([s.name for s in sites if s.name != LEARNT], "curve")  # a curve may have that name
        _all_different([*(p.name for p in given), *(e.name for e in library), *(s.name for s in sites)], "name")
        for what, held in (("fixed", fixed), ("tied", tied)):
            if not isinstance(held, Mapping | None):
                raise DeclarationError(f'{what} is {held!r}: give a mapping by parameter, {{"NAME": ...}}.')
        self.held = Held(dict(fixed or {}), dict(tied or {}))
        self.held.check(given, library)
        free = self.held.free(given)
        for p in free:
            if p.at_least is not None:
                fitted = [q.name for q in free]
                _check_known(f"at_least of {p.name}", [p.at_least], fitted, "is no parameter that is fitted")
                if (most := free[fitted.index(p.at_least)].upper) > p.upper:
                    raise DeclarationError(
                        f"{p.name} cannot fall below {p.at_least}, which may be {most:g}, beyond its own upper bound "
                        f"{p.upper:g}: give both the same upper bound."
                    )
        for effect in library:
            _check_known(f"apart of effect {effect.name}", effect.apart, [p.name for p in given], "is no parameter")
        ordered = {p.name for p in free if p.at_least} | {p.at_least for p in free}
        chosen = {p.name: of_parameter(p, p.name in ordered) for p in free}
        self.parameters = tuple(chosen[p.name].of(p) for p in free)
        self._coordinates = {p.name: chosen[p.name].within(p) for p in free}
        self.effects: dict[str, Effect] = {}
        # value of every parameter, for those not in `theta`; an effect's are its values while it is off
        self._off: dict[str, float] = {p.name: p.value for p in given}
        for effect in library:
            self.effects[effect.name], coordinates = of_effect(self.held.without(effect))
            if not np.isfinite(self.effects[effect.name].absent):
                raise DeclarationError(
                    f"effect {effect.name} is absent at infinity, so its size must keep its sign: set one bound to 0"
                    " or both bounds on the same side of it, and give a typical value other than 0."
                )
            self._coordinates |= coordinates
            self._off |= effect.typical | dict.fromkeys(effect.size_names, effect.absent)
        self._nuisances = nuisances if callable(nuisances) else several(nuisances, Parameter)
        self._regressors = regressors or _regressors
        for what, told in (("accuracy", accuracy), ("sensor_noise", sensor_noise), ("noise_time_s", noise_time_s)):
            _check_amounts(what, told, by_output=what != "noise_time_s")
        if isinstance(noise_time_s, str) and noise_time_s != ESTIMATED:
            raise DeclarationError(
                f'noise_time_s is seconds, seconds by output, or "{ESTIMATED}", not {noise_time_s!r}.'
            )
        self._sensor_noise, self._accuracy = dict(sensor_noise or {}), dict(accuracy or {})
        self.estimates_noise_time = noise_time_s == ESTIMATED
        self._noise_time_s = 0.0 if self.estimates_noise_time else noise_time_s
        self._test: tuple[str, ...] = ()
        self._raised: dict[tuple[str, str], float] = {}
        self._sites = {site.name: site for site in sites}
        if isinstance(spare, str) or not isinstance(spare, Iterable | None):
            raise DeclarationError(f"spare is a collection of conditions: write [{spare!r}].")
        self._experiments = several(experiments, CandidateExperiment)
        kept = None if spare is None else tuple(spare)
        for condition in kept or ():
            check_hashable("a spare condition", condition)
        self._spare = None if kept is None else frozenset(kept)

    def __repr__(self) -> str:
        return f"System({self.name!r}, {len(self.parameters)} parameters, {len(self.effects)} effects)"

    def with_trials(self, trials: Iterable[Record]) -> FunctionSystem:
        """A copy of the system with these measured records. Raises DeclarationError if they lack a condition or output
        that it names, or all experiments of an effect or curve."""
        trials = tuple(trials)
        conditions, outputs = {t.condition for t in trials}, {name for t in trials for name in t.channels}
        experiments = {t.experiment for t in trials}
        _check_known("spare", self._spare or (), conditions)
        seen_in = {f"effect {name}": effect.experiments for name, effect in self.effects.items()}
        seen_in |= {f"curve {name}": site.experiments for name, site in self._sites.items()}
        for which, named in seen_in.items():
            if not experiments.intersection(named):
                _check_known(f"experiments of {which}", named, experiments)
        for what, told in (("accuracy", self._accuracy), ("sensor_noise", self._sensor_noise)):
            _check_known(what, told, outputs)
        if isinstance(self._noise_time_s, Mapping):
            _check_known("noise_time_s", self._noise_time_s, outputs)
        return self._with(trials=trials)

    def _with(self, **changes: Any) -> FunctionSystem:
        other = copy(self)
        vars(other).update(changes)
        return other

    def with_floor(self, least: Mapping[tuple[str, str], float]) -> FunctionSystem:
        """A copy of the system with lower bounds on its noise floors, by (experiment, output)."""
        return self._with(_raised=dict(least))

    def with_test(self, names: Iterable[str]) -> FunctionSystem:
        """A copy of the system with the records of these names as the final test."""
        return self._with(_test=tuple(names))

    def with_noise_time(self, seconds: Mapping[str, float]) -> FunctionSystem:
        """A copy of the system with a declared correlation time of the noise, in seconds, for these outputs."""
        declared = self._noise_time_s if isinstance(self._noise_time_s, Mapping) else {}
        return self._with(_noise_time_s={**declared, **seconds}, estimates_noise_time=False)

    def with_grains(self, grains: Mapping[str, float]) -> FunctionSystem:
        """A copy of the system with `grains`, by full name and in fitted coordinates, as the `Parameter.grain` of
        parameters that declare none."""
        effects = {
            name: replace(
                e, parameters=tuple(replace(p, grain=p.grain or grains.get(e.full_name(p), 0.0)) for p in e.parameters)
            )
            for name, e in self.effects.items()
        }
        parameters = tuple(replace(p, grain=p.grain or grains.get(p.name, 0.0)) for p in self.parameters)
        return self._with(parameters=parameters, effects=effects)

    # -- in the user's parameters -----------------------------------------------------------------------------

    def coordinate(self, name: str) -> Coordinate:
        """Return the coordinate in which parameter `name` is fitted."""
        return self._coordinates.get(name, PLAIN)

    def told(self, parameter: str, value: float) -> float:
        return self.coordinate(parameter).told(value)

    def times_slope(self, parameter: str, value: float) -> float:
        coordinate = self.coordinate(parameter)
        return coordinate.told(value) * coordinate.slope(coordinate.told(value))

    def values(self, theta: Theta, corrections: Sequence[Correction] = ()) -> Values:
        """Return the values passed to `simulate` for a fitted `theta`: the user's parameters and the curves; effects
        that are not in `theta` are off."""
        found = Values(self._off)
        for name, value in theta.items():
            found[name] = self.told(name, value)
        self.held.fill(found)
        if self._sites:
            learnt = {c.site: c.table for c in corrections}
            found |= {name: Curve(site, learnt.get(name)) for name, site in self._sites.items()}
        return found

    def simulated(self, record: Record, values: Values) -> Any:
        """Return what `simulate` returns; for a stretch of a longer run, only the stretch's own samples."""
        if not isinstance(record.payload, Stretch):
            return self.simulated_whole(record, values)
        whole = record.payload
        found = self.simulated_whole(whole.run, values)
        if isinstance(found, Mapping):
            return {name: whole.of(column) for name, column in found.items()}
        return whole.of(found)

    def simulated_whole(self, record: Record, values: Values) -> Any:
        """Call `simulate` on a copy of the record and return a copy of its result, since it may reuse an array and must
        not write into the measurements. Raises MisuseError, naming the column, if it does write into its input."""
        given = replace(
            record, time_s=_copy(record.time_s), inputs=_copy(record.inputs), channels=_copy(record.channels)
        )
        found = self._called(given, values)
        if changed := _changed(record, given):
            raise MisuseError(
                f"trial {record.name}: simulate writes into {changed} of its record, so the next call would find"
                f' different values. Let it work on a copy: record["{changed}"].copy().'
            )
        return found

    def _called(self, record: Record, values: Values) -> Any:
        """Call `simulate`; once it is seen to reuse an output array, only from one thread at a time."""
        values = values.with_attributes()
        if self._refills:
            with _ONE_AT_A_TIME:
                return _copy(self.simulate(record, values))
        found = self.simulate(record, values)
        self._refills = _shares(found, self._last)
        self._last = found
        return _copy(found)

    def run(self, record: Record, values: Values) -> Channels:
        """Return the result of `simulate`, whatever its form, as channels by name."""
        found = self.simulated(record, values)
        if not isinstance(found, Mapping):
            if len(record.channels) != 1:
                raise DeclarationError(
                    f"{self.name}: simulate returned {type(found).__name__}, but the records have the outputs"
                    f" {', '.join(record.channels)}: return them by name, as a dict of arrays."
                )
            found = {next(iter(record.channels)): found}
        return {name: np.asarray(column) for name, column in found.items()}

    # -- the engine's protocol ---------------------------------------------------------------------------------

    def predict(
        self,
        theta: Theta,
        effects: tuple[str, ...],
        trial: Record,
        *,
        coarse: bool = False,
        corrections: Sequence[Correction] = (),
    ) -> Channels:
        return self.run(trial, self.values(theta, corrections))

    def nuisances(self, trial: Record) -> tuple[Parameter, ...]:
        given = self._nuisances
        simulated = trial.payload.run if isinstance(trial.payload, Stretch) else trial
        found = (
            _call_for_trial("nuisances", trial, lambda: several(given(simulated), Parameter))
            if callable(given)
            else given
        )
        for p in found:
            if p.name in self._off or p.name in self._sites:
                raise DeclarationError(f"trial {trial.name}: its nuisance {p.name} has the name of another parameter.")
        return found

    def regressors(self, trial: Record, prediction: Channels) -> dict[str, np.ndarray]:
        found = _call_for_trial(
            "regressors",
            trial,
            lambda: {name: np.asarray(column) for name, column in self._regressors(trial, prediction).items()},
        )
        for name, column in found.items():
            if column.shape != trial.time_s.shape or column.dtype.kind not in "fiub":
                raise DeclarationError(
                    f"regressor {name} of trial {trial.name} is {column.dtype} of shape {column.shape}: give"
                    f" {len(trial.time_s)} numbers, one for each sample."
                )
        return found

    def sensor_noise(self, experiment: str, channel: str) -> float:
        return max(self._sensor_noise.get(channel, 0.0), self._raised.get((experiment, channel), 0.0))

    def accuracy(self, experiment: str, channel: str) -> float:
        return self._accuracy.get(channel, 0.0)

    def noise_time_s(self, experiment: str, channel: str) -> float:
        told = self._noise_time_s
        return told.get(channel, 0.0) if isinstance(told, Mapping) else float(told)

    def spare(self) -> tuple[tuple[str, Hashable], ...]:
        if self._spare is None:
            return middle_conditions(self.trials)
        return tuple({(t.experiment, t.condition) for t in self.trials if t.condition in self._spare})

    def test(self) -> tuple[str, ...]:
        return self._test

    @property
    def correction_sites(self) -> Mapping[str, CorrectionSite]:
        return self._sites

    def candidate_experiments(self) -> tuple[CandidateExperiment, ...]:
        return self._experiments


def _call_for_trial(what: str, trial: Record, ask: Callable[[], Any]) -> Any:
    """Call a user's function for a trial. Raises MisuseError if it fails, DeclarationError if it declares wrongly."""
    try:
        return ask()
    except DeclarationError as error:
        raise DeclarationError(f"trial {trial.name}, its {what}: {error}") from error
    except LacunaError:
        raise
    except Exception as error:
        raise MisuseError(f"trial {trial.name}: its {what} raise {type(error).__name__}: {error}") from error


def _copy(found: Any) -> Any:
    """Copy a column, or every column of a mapping; objects that are not arrays are returned as they are."""
    if isinstance(found, Mapping):
        return {name: _copy(column) for name, column in found.items()}
    return found.copy() if isinstance(found, np.ndarray) else found


def _shares(found: Any, earlier: Any) -> bool:
    """Whether two results of a model share memory."""
    both = (f.values() if isinstance(f, Mapping) else [f] for f in (found, earlier))
    one, other = ([column for column in columns if isinstance(column, np.ndarray)] for columns in both)
    return any(np.may_share_memory(a, b) for a in one for b in other)


def _changed(before: Record, after: Record) -> str | None:
    """Return the name of the first column whose samples differ, or None."""
    if not _is_same(before.time_s, after.time_s):
        return "time_s"
    for old, new in ((before.inputs, after.inputs), (before.channels, after.channels)):
        for name, column in old.items():
            if not _is_same(column, new.get(name)):
                return name
    return None


def _is_same(one: Any, other: Any) -> bool:
    """Whether two columns are bitwise equal: fast, and NaN equals NaN."""
    return not isinstance(one, np.ndarray) or (isinstance(other, np.ndarray) and one.tobytes() == other.tobytes())


def _library(effects: Iterable[Effect] | Effect) -> tuple[Effect, ...]:
    """Return `effects`, given as one effect, a sequence, or a mapping by name, as a tuple."""
    if isinstance(effects, Mapping):
        for key, effect in effects.items():
            if key != effect.name:
                raise DeclarationError(f"effect {effect.name} is listed under the key {key}: use its name as the key.")
        effects = effects.values()
    return several(effects, Effect)


def _check_names(names: Sequence[str], what: str) -> None:
    """Raise DeclarationError if a name is no `theta.NAME`, is reserved for learnt curves, or is used twice."""
    for name in names:
        if "." in name or name == LEARNT or hasattr(Values, name):
            raise DeclarationError(f"{what} {name!r}: choose another name, without a dot; this one is reserved.")
    _all_different(names, what)


def _check_amounts(what: str, told: Any, by_output: bool) -> None:
    """Raise DeclarationError unless `told` maps outputs to amounts or, unless `by_output`, is one amount or a word."""
    if told is None or (isinstance(told, str) and not by_output):
        return
    if not isinstance(told, Mapping):
        if by_output:
            raise DeclarationError(f'{what} is given by output: write {{"OUTPUT": {told!r}}}.')
        told = {"all outputs": told}
    for output, amount in told.items():
        if not isinstance(amount, Real) or not 0.0 <= float(amount) < math.inf:
            raise DeclarationError(f"{what} of {output} is {amount!r}: give a number that is not negative.")


def _check_known(
    what: str, given: Iterable[Hashable], known: Collection[Hashable], which: str = "none of the records has"
) -> None:
    for one in given:
        if one not in known:
            there = ", ".join(sorted(map(str, known)))
            raise DeclarationError(f"{what} names {one!r}, which {which}; there are {there}.")


def _all_different(names: Sequence[str], what: str) -> None:
    for name in names:
        if names.count(name) > 1:
            raise DeclarationError(f"{what} {name} is declared {names.count(name)} times: give each its own name.")


def _regressors(record: Record, prediction: Channels) -> dict[str, np.ndarray]:
    """Default regressors: the outputs, their rates and directions of change, the inputs, and time."""
    found: dict[str, np.ndarray] = {}
    for name, column in prediction.items():
        rate = np.gradient(column, record.time_s)
        found |= {name: column, f"rate of {name}": rate, f"direction of {name}": np.sign(rate)}
    inputs = {name: np.asarray(column) for name, column in record.inputs.items()}
    inputs = {n: c for n, c in inputs.items() if c.shape == record.time_s.shape and c.dtype.kind in "fiub"}
    return found | inputs | {"time": record.time_s}
