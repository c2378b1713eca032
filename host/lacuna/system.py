"""The interface between a model and the engine: what a system declares in order to be fitted and diagnosed.

A `System` is a model with named parameters, a library of effects that the model may lack, and trials: measured records,
each labelled with the experiment that produced it. The engine knows nothing else; the robot is one such system. A plain
function need not derive from it: `lacuna.System` (`function_system.py`) wraps the function.

A parameter of the base model has a plain name (`body_damping_Ns_m`), a parameter of an effect the name
`<effect>.<parameter>` (`hysteresis.force_N`); `theta` is one flat mapping of both.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Integral, Real
from typing import Any, Protocol

import numpy as np

from lacuna.errors import DeclarationError, LacunaError, MisuseError

Theta = Mapping[str, float]
Channels = dict[str, np.ndarray]

START_FACTORS = (0.1, 0.4, 1.2)  # initial sizes of an effect, as multiples of its typical size
LEARNT = "correction"  # prefix of the parameter names of learnt curves; no effect may have this name


@dataclass(frozen=True)
class Parameter:
    """A number to be estimated.

    `value` is the initial value of the search; `lower` and `upper` bound it. `plausible` is the narrower range of
    reasonable values, both ends finite (None: not known); a fit that leaves it is evidence against the model, not an
    error. `scale` is the change of the parameter that matters, in its own unit; derivatives step by a small fraction of
    it (never relative to the value, which may be 0). For a nuisance it is the standard deviation from run to run, so
    declare it there. The default is a tenth of |value|, or of the range, which must then be finite, if the value is 0.
    `prior_sd` is the standard
    deviation of the parameter's prior around `value`; None: no prior.

    `at_least`: for a parameter of the base model, the name of another one that it cannot fall below, and whose upper
    bound must not be above its own. `elsewhere`:
    further initial values of graduated fits, for a parameter whose isolating trials fit equally well at several values.
    `factor_of`: for a nuisance, the parameters that it multiplies in its trial; its derivatives are then computed from
    theirs, so that the data do not falsely seem to distinguish a change of all trials' factors from a change of the
    parameters. `grain`: the smallest change of the parameter that changes a prediction, for a model that rounds it (a
    delay in whole samples); derivatives step at least this far. `periodic`: for an effect's own parameter, `lower` and
    `upper` denote the same value and are not bounds (a phase). `prior_from_trials`: the prior itself was estimated from
    the fitted trials, by a base model without effects; it guides the search and is relaxed for the final estimates.
    """

    name: str
    unit: str
    value: float
    lower: float
    upper: float
    plausible: tuple[float, float] | None = None
    scale: float | None = None
    source: str = ""
    prior_sd: float | None = None
    at_least: str | None = None
    elsewhere: tuple[float, ...] = ()
    factor_of: tuple[str, ...] = ()
    grain: float = 0.0
    periodic: bool = False
    prior_from_trials: bool = False

    def __post_init__(self) -> None:
        _check_text("a parameter's name", self.name)
        for what in ("value", "lower", "upper"):
            if not isinstance(given := getattr(self, what), Real):
                raise DeclarationError(f"{self.name}: {what} is {given!r}, not a number")
        if not self.lower < self.upper:
            raise DeclarationError(f"{self.name}: lower {self.lower} is not below upper {self.upper}")
        if not _is_number(self.value):
            raise DeclarationError(f"{self.name}: value is {self.value}: fits begin there, so give a finite number")
        if not self.lower <= self.value <= self.upper:
            raise DeclarationError(f"{self.name}: value {self.value} is outside {self.lower} to {self.upper}")
        for what in ("scale", "prior_sd"):
            given = getattr(self, what)
            if given is not None and not (_is_number(given) and given > 0.0):
                raise DeclarationError(f"{self.name}: {what} is {given!r}: give a number above 0, or leave it out")
        if self.scale is None and not self.value and not np.isfinite(self.upper - self.lower):
            raise DeclarationError(
                f"{self.name}: neither its value, 0, nor its range, {self.lower:g} to {self.upper:g}, tells which"
                " change of it matters: give `scale`, or finite bounds"
            )
        if not (_is_number(self.grain) and self.grain >= 0.0):
            raise DeclarationError(f"{self.name}: grain is {self.grain!r}: give a number that is not negative")
        object.__setattr__(self, "elsewhere", several(self.elsewhere, Real))
        for given in self.elsewhere:
            if not self.lower <= given <= self.upper:
                raise DeclarationError(f"{self.name}: elsewhere has {given}, outside {self.lower} to {self.upper}")
        if self.plausible is not None and not _is_range(self.plausible):
            raise DeclarationError(f"{self.name}: plausible is {self.plausible!r}: give two numbers, the lower first")

    @property
    def step_scale(self) -> float:
        """`scale`; if none is given, a tenth of |value|, or of the range if the value is 0."""
        if self.scale is not None:
            return self.scale
        return 0.1 * (abs(self.value) or self.upper - self.lower)


def _one_scale_away(p: Parameter) -> Parameter:
    away = p.value + p.step_scale
    return replace(p, value=away if away <= p.upper else max(p.value - p.step_scale, p.lower), scale=p.step_scale)


def _is_range(given: Any) -> bool:
    """Whether `given` is two finite numbers, the lower first."""
    return np.shape(given) == (2,) and all(map(_is_number, given)) and bool(given[0] < given[1])


def _is_number(given: Any) -> bool:
    """Whether `given` is a finite number."""
    return isinstance(given, Real) and bool(-np.inf < float(given) < np.inf)


def _check_text(what: str, given: Any) -> None:
    if not isinstance(given, str):
        raise DeclarationError(f"{what} is {given!r:.60}, which is a {type(given).__name__}, not text")


def check_hashable(what: str, given: Any) -> None:
    """Raise DeclarationError if `given` cannot be the member of a set, as conditions have to."""
    try:
        hash(given)
    except TypeError:
        raise DeclarationError(
            f"{what} is {given!r:.60}, a {type(given).__name__}: give text, a number or a tuple of them"
        ) from None


def several(given: Any, kind: type) -> tuple[Any, ...]:
    """Return `given`, one of `kind` or an iterable of them, as a tuple. Raises DeclarationError for anything else."""
    found = tuple(given) if isinstance(given, Iterable) and not isinstance(given, kind) else (given,)
    for one in found:
        if not isinstance(one, kind):
            raise DeclarationError(f"{one!r:.60} is of type {type(one).__name__}, not {kind.__name__}")
    return found


@dataclass(frozen=True)
class Effect:
    """A physical mechanism that the base model leaves out.

    The first `sizes` of `parameters` set the size of the effect: it vanishes when all of them equal `absent` (0 by
    default); the others only shape it. Parameters have local names (`force_N`) and appear in `theta` as
    `hysteresis.force_N`. A parameter's `value` is a typical magnitude; if it is `absent`, one `scale` from there. Fits
    start at the typical sizes times each of `start_factors` (and with the opposite sign, if the bounds allow it).

    `enters` names the term of the model that changes ("body spring", "pressure sensor"). `experiments` lists those in
    which the effect can be visible (empty: all). `own` are parameters with a separate value in every trial (a phase):
    they are fitted trial by trial, from the best of several values over their range; one without a `scale` may lie
    anywhere in it. `frequency` is the local name of the parameter that is a frequency, in Hz: fits start at the peaks
    of the residual's spectrum, since from anywhere else they would not converge to it. `freed_at`: correction sites
    where the mechanism may act in a form other than its formula's; a curve there is tried before a further effect is
    considered. `apart`: base parameters that must lie above the limit set by their `Parameter.at_least` for the effect
    to act at all; if a fit without the effect ended at that limit, fits with it begin with the two apart.
    """

    name: str
    parameters: tuple[Parameter, ...]  # a single one may be given as such
    enters: str = ""
    experiments: tuple[str, ...] = ()
    equation: str = ""
    source: str = ""
    sizes: int = 1
    absent: float = 0.0
    start_factors: tuple[float, ...] = START_FACTORS
    own: tuple[Parameter, ...] = ()
    frequency: str | None = None
    freed_at: tuple[str, ...] = ()
    apart: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check_text("an effect's name", self.name)
        for each in ("parameters", "own"):
            object.__setattr__(self, each, several(getattr(self, each), Parameter))
        for each in ("experiments", "freed_at", "apart"):
            object.__setattr__(self, each, several(getattr(self, each), str))
        object.__setattr__(self, "start_factors", several(self.start_factors, Real))
        for one in self.own:
            if one.scale is None and not _is_range((one.lower, one.upper)):
                raise DeclarationError(f"effect {self.name}: own {one.name} needs finite bounds, or a scale")
        if not self.start_factors or not all(map(_is_number, self.start_factors)):
            raise DeclarationError(f"effect {self.name}: `start_factors` is {self.start_factors}: give finite numbers")
        if not isinstance(self.absent, Real) or np.isnan(self.absent):
            raise DeclarationError(f"effect {self.name}: `absent` is {self.absent!r}, not a number")
        if not 1 <= self.sizes <= len(self.parameters):
            raise DeclarationError(f"effect {self.name}: `sizes` is {self.sizes} for {len(self.parameters)} parameters")
        sizing, shaping = self.parameters[: self.sizes], self.parameters[self.sizes :]
        if all(p.value == self.absent for p in sizing):  # a fit that begins there sees no effect
            object.__setattr__(self, "parameters", (*map(_one_scale_away, sizing), *shaping))
        names = [p.name for p in self.parameters]
        if self.frequency is not None and self.frequency not in names:
            raise DeclarationError(
                f"effect {self.name}: `frequency` is {self.frequency!r}, which is none of {', '.join(names)}"
            )
        for p in (*self.parameters, *self.own):
            if p.at_least is not None:
                raise DeclarationError(
                    f"effect {self.name}: {p.name} has `at_least`, which is for base parameters only: declare the"
                    f" difference to {p.at_least} instead"
                )

    def full_name(self, parameter: Parameter) -> str:
        """The name of `parameter` in `theta`: `<effect>.<parameter>`."""
        return f"{self.name}.{parameter.name}"

    def shows_in(self, trial: Record) -> bool:
        """Whether the effect can be visible in the experiment of `trial`."""
        return not self.experiments or trial.experiment in self.experiments

    @property
    def typical(self) -> dict[str, float]:
        """Typical value of each parameter by full name, including those with a separate value in every trial."""
        return {self.full_name(p): p.value for p in (*self.parameters, *self.own)}

    @property
    def size_names(self) -> tuple[str, ...]:
        """Full names of the parameters that set the size of the effect."""
        return tuple(self.full_name(p) for p in self.parameters[: self.sizes])


@dataclass(frozen=True)
class Record:
    """One measured record.

    `channels` maps each channel's name, which includes the unit, to its samples, shape (n,); NaN where a sample is
    missing. `time_s` has shape (n,). Trials with an equal `condition` are repeats of one another: the noise floor comes
    from them. `session_order` is the trial's position in the day, None if not known. `inputs` holds, by name, the
    quantities that were applied rather than predicted: arrays of shape (n,) and single values. `payload` is for the
    system's own use. `clock` is the name of the source column that the times came from.
    """

    name: str
    experiment: str
    condition: Hashable
    time_s: np.ndarray
    channels: Channels
    session_order: int | None = None
    payload: Any = None
    inputs: Mapping[str, Any] = field(default_factory=dict)
    clock: str = ""

    def __post_init__(self) -> None:
        check_hashable(f"record {self.name}: its condition", self.condition)

    def __getitem__(self, name: str) -> Any:
        """Return an input, a measured channel, or `time_s`. Raises KeyError, listing what there is."""
        columns = self._columns()
        if name not in columns:
            raise KeyError(f"{name}: record {self.name} has {', '.join(columns)}")
        return columns[name]

    def __contains__(self, name: object) -> bool:
        return name in self._columns()

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the columns, as a mapping does."""
        return iter(self._columns())

    def _columns(self) -> dict[str, Any]:
        return {"time_s": self.time_s, **self.channels, **self.inputs}

    def __repr__(self) -> str:
        return f"Record({self.name!r}, {len(self.time_s)} samples of {', '.join(self.channels)})"


def no_prediction(trial: Record) -> Channels:
    """The channels of a trial whose simulation failed: NaN throughout."""
    return {name: np.full(column.shape, np.nan) for name, column in trial.channels.items()}


def misshapen(found: Channels, trial: Record) -> str:
    """What is wrong with the form of a prediction of a trial, naming the channel; empty if nothing is. Raises
    MisuseError if a channel is missing, which no value of a parameter excuses."""
    if not isinstance(found, Mapping):
        raise MisuseError(f"trial {trial.name}: the model returns {type(found).__name__}, not channels by name.")
    for name, measured in trial.channels.items():
        if name not in found:
            there = ", ".join(map(str, found)) or "nothing"
            raise MisuseError(f"trial {trial.name}, channel {name}: not predicted; the model returns {there}.")
        column = found[name]
        if not isinstance(column, np.ndarray) or column.dtype.kind not in "fiu":
            kind = f"array of {column.dtype}" if isinstance(column, np.ndarray) else type(column).__name__
            return f"channel {name}: predicted as {kind}, not as an array of real numbers"
        if column.shape != np.shape(measured):
            return f"channel {name}: predicted with shape {column.shape}, measured with {np.shape(measured)}"
    return ""


def groups_of_repeats(trials: Sequence[Record]) -> list[list[Record]]:
    """Group trials by experiment and condition, in order of first appearance."""
    groups: dict[Hashable, list[Record]] = {}
    for trial in trials:
        groups.setdefault((trial.experiment, trial.condition), []).append(trial)
    return list(groups.values())


def by_channel(trials: Iterable[Record]) -> dict[tuple[str, str], list[Record]]:
    """Trials that have each channel, by (experiment, channel), in order of first appearance."""
    found: dict[tuple[str, str], list[Record]] = defaultdict(list)
    for trial in trials:
        for channel in trial.channels:
            found[trial.experiment, channel].append(trial)
    return found


def middle_conditions(trials: Sequence[Record]) -> tuple[tuple[str, Hashable], ...]:
    """The middle condition of each experiment that has three or more repeated conditions, sorted by the mean of their
    first channel: the default for conditions that are never fitted."""
    means: dict[str, dict[Hashable, float]] = defaultdict(dict)
    for members in groups_of_repeats(trials):
        if len(members) > 1:
            samples = np.concatenate([next(iter(t.channels.values())) for t in members])
            means[members[0].experiment][members[0].condition] = float(np.nanmean(samples))
    many = {experiment: each for experiment, each in means.items() if len(each) >= 3}
    return tuple((experiment, sorted(each, key=each.__getitem__)[len(each) // 2]) for experiment, each in many.items())


@dataclass(frozen=True)
class CorrectionSite:
    """A term of an equation to which a curve learnt from data may be added.

    The curve is a spline in `variable` with `knots` knots between `lower` and `upper`, constant beyond; one curve for
    each of `rows` if it differs by direction, actuator or the like. `scale` is the change of the term that matters, in
    `unit`. Empty `experiments`: the curve acts in all. Example: site `body_spring`, term "force of the body's spring",
    variable "displacement (m)", unit N.
    """

    name: str
    term: str
    variable: str
    unit: str
    lower: float
    upper: float
    scale: float
    rows: tuple[str, ...] = ("",)
    experiments: tuple[str, ...] = ()
    knots: int = 9

    def __post_init__(self) -> None:
        for each in ("rows", "experiments"):
            object.__setattr__(self, each, several(getattr(self, each), str))
        if not _is_range((self.lower, self.upper)):
            raise DeclarationError(f"curve {self.name}: {self.lower!r} to {self.upper!r} is not a finite range")
        if not (_is_number(self.scale) and self.scale > 0.0):
            raise DeclarationError(f"curve {self.name}: scale is {self.scale!r}: give a number above 0")
        if not self.rows or not isinstance(self.knots, Integral) or self.knots < 2:
            raise DeclarationError(f"curve {self.name} has {len(self.rows)} rows of {self.knots!r} knots: too few")


@dataclass(frozen=True)
class Correction:
    """The curve learnt at a site. `table`, shape (rows of the site, n), holds its values on a uniform grid from the
    site's lower to its upper end, to be interpolated linearly."""

    site: str
    table: np.ndarray


@dataclass(frozen=True)
class CandidateExperiment:
    """An experiment that could be run next. `trial` is passed to `predict`; its channels hold a NaN for each sample
    that would be taken. `settings` is what an operator or a rig needs to run it."""

    experiment: str
    settings: Mapping[str, Any]
    trial: Record


class System(Protocol):
    """The model as the engine sees it. Derive from this class and define the first five members (`name` to `predict`);
    the rest have neutral defaults.

    `predict` is called from several threads at once, so it must not change the system; it is fast if it releases the
    GIL.
    """

    name: str
    parameters: tuple[Parameter, ...]  # the fitted parameters of the base model
    effects: Mapping[str, Effect]
    trials: tuple[Record, ...]

    def predict(
        self,
        theta: Theta,
        effects: tuple[str, ...],
        trial: Record,
        *,
        coarse: bool = False,
        corrections: Sequence[Correction] = (),
    ) -> Channels:
        """Simulate a trial as a free run, from its initial state and inputs, never from measured outputs.

        `theta` holds every base parameter, those of the active `effects`, and this trial's nuisances under their own
        names. Returns the channels of `trial.channels` in the same shapes; NaN where the simulation failed. `coarse`
        allows a cheaper simulation that is good enough for derivatives; otherwise the integrator's error must be well
        below the noise, or it will be mistaken for structure.
        """
        ...

    at_once: int = 1  # number of trials that `predict_trials` simulates at little more than the cost of one
    forks: bool = False  # whether a fork of this process may simulate; False if it has threads or devices of its own
    tells_of_all: bool = False  # whether reported parameters come from a fit to every record, held-out ones included
    # whether nuisances vary independently from run to run, so that repeats have none in common (`nuisances.py`)
    nuisances_per_run: bool = False

    def predict_trials(
        self,
        thetas: Sequence[Theta],
        effects: tuple[str, ...],
        trials: Sequence[Record],
        *,
        coarse: bool = False,
        corrections: Sequence[Sequence[Correction]] = (),
        alike: bool = False,
    ) -> list[Channels]:
        """Predict each of `trials` with the corresponding one of `thetas`. Override it, and set `at_once`, if
        simulating several trials of one experiment side by side is cheaper, or one trial with several `thetas`.
        `alike`: all `thetas` are close to the first and will be compared with it, as for derivatives, so integrator
        errors should cancel as far as possible. A failed simulation does not stop the search: if `predict` raises a
        ValueError or an ArithmeticError, or returns a channel whose shape differs from the measured one, the prediction
        is NaN. Raises MisuseError, as `attempt` does."""
        corrections = corrections or [()] * len(thetas)
        found = []
        for theta, trial, learnt in zip(thetas, trials, corrections, strict=True):
            one = self.attempt(theta, effects, trial, coarse=coarse, corrections=learnt)
            found.append(no_prediction(trial) if isinstance(one, str) or misshapen(one, trial) else one)
        return found

    def attempt(self, theta: Theta, effects: tuple[str, ...], trial: Record, **how: Any) -> Channels | str:
        """Predict a trial (`how`: options of `predict`), or say why it cannot be simulated with these values: the
        ValueError or ArithmeticError that `predict` raises. Raises MisuseError, naming trial and values, for any other
        error of the model."""
        try:
            return self.predict(theta, effects, trial, **how)
        except LacunaError:
            raise
        except (ValueError, ArithmeticError) as error:
            return f"{type(error).__name__}: {error}".strip()
        except Exception as error:
            at = ", ".join(f"{name} = {self.told(name, value):.6g}" for name, value in theta.items())
            raise MisuseError(
                f"trial {trial.name}: the model raises {type(error).__name__}: {error} at {at}. Return NaN where it"
                " cannot be simulated."
            ) from error

    def regressors(self, trial: Record, prediction: Channels) -> dict[str, np.ndarray]:
        """Quantities on which a residual may depend, by name, each of shape (n,): "displacement", "direction of
        motion", "velocity", "command", "time since the last switch", "position in the pipe" ..."""
        return {}

    def nuisances(self, trial: Record) -> tuple[Parameter, ...]:
        """Quantities of this trial that vary from run to run: fitted for each trial, with a Gaussian prior of mean
        `value` and standard deviation `scale`."""
        return ()

    def matters(self, parameter: str, trial: Record) -> bool:
        """Whether a base parameter can change a trial; False saves a simulation per derivative."""
        return True

    def isolates(self, trial: Record) -> bool:
        """Whether a trial isolates a few parameters. Graduated fits start with such trials; starting with trials in
        which everything acts together and small errors accumulate, they would end in a local optimum."""
        return True

    def spare(self) -> Collection[tuple[str, Hashable]]:
        """(experiment, condition) of the trials that are never fitted: explanations are judged by how well they predict
        them. Choose conditions that lie between others, so that the fitted ones still determine every parameter."""
        return ()

    def test(self) -> Collection[str]:
        """Names of the trials that inform no choice and form the final test. Empty: some of each condition."""
        return ()

    def accuracy(self, experiment: str, channel: str) -> float:
        """RMS error, in the channel's unit, up to which a prediction is good enough, whatever the noise. 0: only the
        noise counts."""
        return 0.0

    def sensor_noise(self, experiment: str, channel: str) -> float:
        """Standard deviation of the instrument alone, in the channel's unit: a lower bound of the noise floor. 0: not
        known."""
        return 0.0

    def told(self, parameter: str, value: float) -> float:
        """Convert a fitted value of a parameter to the user's parametrization, if the two differ (a logarithm)."""
        return value

    def times_slope(self, parameter: str, value: float) -> float:
        """Derivative of the fitted value with respect to the logarithm of the parameter as the user declared it: the
        value itself, if the two do not differ."""
        return value

    def noise_time_s(self, experiment: str, channel: str) -> float:
        """Correlation time of the noise, in s, used if there are no repeats to show it. 0: only the fast noise of a
        record counts as noise, anything slower as structure."""
        return 0.0

    @property
    def correction_sites(self) -> Mapping[str, CorrectionSite]:
        """Terms at which a curve may be learnt if no effect explains the residual, by name."""
        return {}

    def candidate_experiments(self) -> tuple[CandidateExperiment, ...]:
        """Experiments that could be run next, among which the most informative is recommended."""
        return ()
