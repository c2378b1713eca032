"""What a system must declare so that it can be fitted and diagnosed.

A `System` is a model with named parameters, a library of effects that the model may lack, and trials:
measured records with the experiment that produced them. The engine knows nothing else; the robot is one system. For a
plain function there is no need to derive from it: `lacuna.System` (`function_system.py`) wraps the function.

Every parameter of the base model has a plain name (`body_damping_Ns_m`), every parameter of an effect the
name `<effect>.<parameter>` (`hysteresis.force_N`); `theta` is one flat mapping of both.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral, Real
from typing import Any, Protocol

import numpy as np

from lacuna.errors import DeclarationError

Theta = Mapping[str, float]
Channels = dict[str, np.ndarray]

START_FACTORS = (0.1, 0.4, 1.2)  # of an effect's typical sizes: where fits begin
LEARNT = "correction"  # what parameter names of learnt curves begin with, so that no effect may be called so


@dataclass(frozen=True)
class Parameter:
    """One number to be estimated.

    `value` is where the search starts; `lower` and `upper` bound it. `plausible` is the narrower range of
    reasonable values, both ends finite (None: not known): a fit that leaves it is evidence against the model,
    not an error. `scale` is the change of the parameter that matters, in its own unit: derivatives step by
    a small fraction of it (never relative to the value, which may be 0). For a nuisance it is the standard
    deviation of its spread. `prior_sd`: standard deviation of its prior, around `value`; None: no prior.
    `at_least`, of the base model, names another parameter that it cannot be below. `elsewhere`: further initial values
    for graduated fits, for a parameter whose isolating trials fit equally well at several values. `factor_of`: of a
    nuisance, the parameters that it multiplies in its trial; its derivatives are theirs then, to the last digit, and
    data do not seem to tell a change of all trials' factors from one of the parameters. `grain`: the least change that
    changes a prediction, where a model counts (a delay in whole samples): derivatives step as far at least. `periodic`:
    of an effect's own parameter, `lower` and `upper` mean the same and are no bounds (a phase). `prior_from_trials`:
    what is known of it beforehand comes from the trials that are fitted, by a base model that knew of no effect; it
    guides the search, and stands back where the parameters are finally told. Without a `scale` it is a tenth
    of |value|, or of the range for a value of 0: of a nuisance, declare it.
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
        for what in ("value", "lower", "upper"):
            if not isinstance(given := getattr(self, what), Real):
                raise DeclarationError(f"{self.name}: {what} is {given!r}, not a number")
        if not self.lower < self.upper:
            raise DeclarationError(f"{self.name}: lower {self.lower} is not below upper {self.upper}")
        if not self.lower <= self.value <= self.upper:
            raise DeclarationError(f"{self.name}: value {self.value} is outside {self.lower} to {self.upper}")
        if not _is_number(self.value):
            raise DeclarationError(f"{self.name}: value is {self.value}: fits begin there, so give a finite number")
        for what in ("scale", "prior_sd"):
            given = getattr(self, what)
            if given is not None and not (_is_number(given) and given > 0.0):
                raise DeclarationError(f"{self.name}: {what} is {given!r}: give a number above 0, or leave it out")
        if not (_is_number(self.grain) and self.grain >= 0.0):
            raise DeclarationError(f"{self.name}: grain is {self.grain!r}: give a number that is not negative")
        object.__setattr__(self, "elsewhere", several(self.elsewhere, Real))
        for given in self.elsewhere:
            if not self.lower <= given <= self.upper:
                raise DeclarationError(f"{self.name}: elsewhere names {given}, outside {self.lower} to {self.upper}")
        if self.plausible is not None and not _is_range(self.plausible):
            raise DeclarationError(f"{self.name}: plausible is {self.plausible!r}: give two numbers, the lower first")

    @property
    def step_scale(self) -> float:
        """`scale`, or where none is given a tenth of |value|, or of the range for a value of 0."""
        if self.scale is not None:
            return self.scale
        return 0.1 * (abs(self.value) or min(self.upper - self.lower, 1e6))


def _is_range(given: Any) -> bool:
    """Whether these are two finite numbers, the lower first."""
    return np.shape(given) == (2,) and all(map(_is_number, given)) and bool(given[0] < given[1])


def _is_number(given: Any) -> bool:
    """Whether this is a finite one."""
    return isinstance(given, Real) and bool(-np.inf < float(given) < np.inf)


def several(given: Any, kind: type) -> tuple[Any, ...]:
    """What was given as some of a kind, or as one of it without brackets. Raises DeclarationError for anything else."""
    found = tuple(given) if isinstance(given, Iterable) and not isinstance(given, kind) else (given,)
    for one in found:
        if not isinstance(one, kind):
            raise DeclarationError(f"{one!r:.60} is of type {type(one).__name__}, not {kind.__name__}")
    return found


@dataclass(frozen=True)
class Effect:
    """A real mechanism that the base model leaves out.

    The first `sizes` of `parameters` size the effect: it vanishes if all of them equal `absent` (0
    by default); the others only shape it. They have local names (`force_N`); in `theta` they
    appear as `hysteresis.force_N`. A parameter's `value` is a typical magnitude. Fits start at the typical
    sizes times each of `start_factors` (and with the other sign, where the bounds allow it). `enters` names
    the term of the model that changes ("body spring", "pressure sensor"), `experiments` those in which it
    can be visible (empty: all). `own` are parameters with a separate value in every trial (a phase): they
    are fitted trial by trial, from the best of several values over their range; one without a `scale` may lie anywhere
    in it. `frequency` names, as it is called in the effect, the
    parameter that is a frequency, in Hz: fits start at the peaks of the residual's spectrum, since from
    anywhere else they would not converge to it. `freed_at`: correction sites where this mechanism may act in another
    form than its formula's; a curve there is tried before another effect is called in. `apart`: base parameters
    without which the effect does nothing while they are as low as `Parameter.at_least` lets them; where a fit without
    the effect made them one, fits with it begin with the two apart.
    """

    name: str
    parameters: tuple[Parameter, ...]  # one alone needs no brackets
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
        for each in ("parameters", "own"):
            object.__setattr__(self, each, several(getattr(self, each), Parameter))
        for each in ("experiments", "freed_at", "apart"):
            object.__setattr__(self, each, several(getattr(self, each), str))
        object.__setattr__(self, "start_factors", several(self.start_factors, Real))
        for one in self.own:
            if one.scale is None and not _is_range((one.lower, one.upper)):
                raise DeclarationError(f"effect {self.name}: own {one.name} needs finite bounds, or a scale")
        if not self.start_factors or not all(map(_is_number, self.start_factors)):
            raise DeclarationError(f"effect {self.name}: `start_factors` is {self.start_factors}: give numbers")
        if not isinstance(self.absent, Real) or np.isnan(self.absent):
            raise DeclarationError(f"effect {self.name}: `absent` is {self.absent!r}, not a number")
        if not 1 <= self.sizes <= len(self.parameters):
            raise DeclarationError(f"effect {self.name}: `sizes` is {self.sizes}, of {len(self.parameters)} parameters")
        names = [p.name for p in self.parameters]
        if self.frequency is not None and self.frequency not in names:
            raise DeclarationError(
                f"effect {self.name}: `frequency` is {self.frequency!r}, which is none of {', '.join(names)}"
            )
        for p in (*self.parameters, *self.own):
            if p.at_least is not None:
                raise DeclarationError(
                    f"effect {self.name}: {p.name} has `at_least`, which is for base parameters: declare the difference"
                    f" to {p.at_least} instead"
                )

    def full_name(self, parameter: Parameter) -> str:
        return f"{self.name}.{parameter.name}"

    def shows_in(self, trial: Record) -> bool:
        """Whether it can be visible in a trial, by its experiment."""
        return not self.experiments or trial.experiment in self.experiments

    @property
    def typical(self) -> dict[str, float]:
        """The typical value of each of its parameters, those of each trial's own included, by full names."""
        return {self.full_name(p): p.value for p in (*self.parameters, *self.own)}

    @property
    def size_names(self) -> tuple[str, ...]:
        """The full names of the parameters that size the effect."""
        return tuple(self.full_name(p) for p in self.parameters[: self.sizes])


@dataclass(frozen=True)
class Record:
    """One measured record.

    `channels` maps a channel's name to its samples, shape (n,), unit in the name; NaN where a sample is
    missing. `time_s` has shape (n,). Trials with an equal `condition` are repeats of one another: the noise
    floor comes from them. `session_order` is the trial's position in the day, None if not known. `inputs`: quantities
    that were applied rather than predicted, by name: arrays of shape (n,) and single values. `payload` is for the
    system's own use. `clock`: the name that the times had where they were read.
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

    def __getitem__(self, name: str) -> Any:
        """An input, a measured channel, or `time_s`; KeyError says what there is."""
        columns = {"time_s": self.time_s, **self.channels, **self.inputs}
        if name not in columns:
            raise KeyError(f"{name}: record {self.name} has {', '.join(columns)}")
        return columns[name]

    def __repr__(self) -> str:
        return f"Record({self.name!r}, {len(self.time_s)} samples of {', '.join(self.channels)})"


def groups_of_repeats(trials: Sequence[Record]) -> list[list[Record]]:
    """Trials of the same experiment and condition, in the order in which these first appear."""
    groups: dict[Hashable, list[Record]] = {}
    for trial in trials:
        groups.setdefault((trial.experiment, trial.condition), []).append(trial)
    return list(groups.values())


def by_channel(trials: Iterable[Record]) -> dict[tuple[str, str], list[Record]]:
    """Trials by experiment and channel that they have, in the order in which these first appear."""
    found: dict[tuple[str, str], list[Record]] = defaultdict(list)
    for trial in trials:
        for channel in trial.channels:
            found[trial.experiment, channel].append(trial)
    return found


def middle_conditions(trials: Sequence[Record]) -> tuple[tuple[str, Hashable], ...]:
    """Of each experiment with three repeated conditions or more the one between the others, by the mean of what was
    measured first: what is never fitted where nobody has said what should be."""
    means: dict[str, dict[Hashable, float]] = defaultdict(dict)
    for members in groups_of_repeats(trials):
        if len(members) > 1:
            samples = np.concatenate([next(iter(t.channels.values())) for t in members])
            means[members[0].experiment][members[0].condition] = float(np.nanmean(samples))
    many = {experiment: each for experiment, each in means.items() if len(each) >= 3}
    return tuple((experiment, sorted(each, key=each.__getitem__)[len(each) // 2]) for experiment, each in many.items())


@dataclass(frozen=True)
class CorrectionSite:
    """A term of an equation that may be replaced by "the model's term plus a curve learnt from data".

    The curve is a function of `variable` between `lower` and `upper` (constant beyond), a spline through as many
    `knots`; one curve for each of `rows`, where it differs by direction, actuator or the like. `scale` is the change of
    the term that matters, in `unit`. Example: site `body_spring`, term "force of the body's spring", variable
    "displacement (m)", unit N.
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
            raise DeclarationError(f"curve {self.name}: {self.lower!r} to {self.upper!r} is no finite range")
        if not (_is_number(self.scale) and self.scale > 0.0):
            raise DeclarationError(f"curve {self.name}: scale is {self.scale!r}: give a number above 0")
        if not self.rows or not isinstance(self.knots, Integral) or self.knots < 2:
            raise DeclarationError(f"curve {self.name} has {len(self.rows)} rows of {self.knots!r} knots: too few")


@dataclass(frozen=True)
class Correction:
    """A learnt curve at a site: `table`, shape (rows of the site, n), holds its values on a uniform grid from the
    site's lower to its upper end. Interpolate linearly."""

    site: str
    table: np.ndarray


@dataclass(frozen=True)
class CandidateExperiment:
    """An experiment that could be run next: `trial` is passed to `predict`; its channels hold NaN, one for
    each sample that would be taken. `settings` is what an operator or a rig needs to run it."""

    experiment: str
    settings: Mapping[str, Any]
    trial: Record


class System(Protocol):
    """Derive from this class and define the first five members; the rest have neutral defaults.

    `predict` is called from several threads at once: it must not change the system, and is fast when it
    releases the GIL.
    """

    name: str
    parameters: tuple[Parameter, ...]  # of the base model, those that are to be fitted
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
        """Free run of a trial (from its initial state and inputs, never from measured outputs).

        `theta` holds every base parameter, those of the active `effects`, and this trial's nuisances under
        their own names. Returns the same channels and shapes as `trial.channels`; NaN where the simulation
        failed. `coarse` allows a cheaper simulation, good enough for derivatives; otherwise the
        integrator's error must be well under the noise, or it will be taken for structure.
        """
        ...

    def predict_many(
        self,
        thetas: Sequence[Theta],
        effects: tuple[str, ...],
        trial: Record,
        *,
        coarse: bool = False,
        corrections: Sequence[Sequence[Correction]] = (),
        alike: bool = False,
    ) -> list[Channels]:
        """`predict` for each of `thetas`, with its own `corrections` if any. Override it, or `predict_trials`, if
        simulating many at once is cheaper. `alike`: all are near the first and are to be compared with it, as for
        derivatives; so let errors of the integrator be alike, too, if possible."""
        trials = [trial] * len(thetas)
        return self.predict_trials(thetas, effects, trials, coarse=coarse, corrections=corrections, alike=alike)

    at_once: int = 1  # trials that `predict_trials` simulates at little more than the cost of one
    forks: bool = False  # whether a fork of this process may simulate: not if it has threads or devices of its own
    tells_of_all: bool = False  # whether parameters are told from a fit to every record, those too that judged
    # whether each run draws its own nuisances, so that repeats share nothing of them (`nuisances.py`)
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
        """`predict` for one of `thetas` in each of `trials`. Override it, and set `at_once`, if simulating several
        trials of one experiment side by side is cheaper. `alike`: as in `predict_many`."""
        corrections = corrections or [()] * len(thetas)
        return [
            self.predict(theta, effects, trial, coarse=coarse, corrections=learnt)
            for theta, trial, learnt in zip(thetas, trials, corrections, strict=True)
        ]

    def regressors(self, trial: Record, prediction: Channels) -> dict[str, np.ndarray]:
        """Named quantities, shape (n,) each, on which a residual may depend: "displacement", "direction of
        motion", "velocity", "command", "time since the last switch", "position in the pipe" ..."""
        return {}

    def nuisances(self, trial: Record) -> tuple[Parameter, ...]:
        """What varies from run to run in this trial: fitted for each trial, with a Gaussian prior of mean
        `value` and standard deviation `scale`."""
        return ()

    def matters(self, parameter: str, trial: Record) -> bool:
        """False if this base parameter cannot change this trial: saves a simulation per derivative."""
        return True

    def isolates(self, trial: Record) -> bool:
        """Whether a trial isolates a few parameters. Graduated fits start with such trials: in one where everything
        acts together, and small errors accumulate, they would end in a wrong minimum."""
        return True

    def spare(self) -> Collection[tuple[str, Hashable]]:
        """(experiment, condition) of trials that are never fitted: explanations are judged by how well they predict
        them. Choose conditions between others, so that the fitted ones still determine every parameter."""
        return ()

    def test(self) -> Collection[str]:
        """Names of the trials that inform no choice and are the test. Empty: some of each condition."""
        return ()

    def accuracy(self, experiment: str, channel: str) -> float:
        """RMS error, in the channel's unit, up to which a prediction is good enough whatever the noise is. 0: only the
        noise counts."""
        return 0.0

    def sensor_noise(self, experiment: str, channel: str) -> float:
        """Standard deviation of the instrument alone, in the channel's unit: the floor's lower bound.
        0: not known."""
        return 0.0

    def told(self, parameter: str, value: float) -> float:
        """A parameter's fitted value in the user's terms, if the two differ (a logarithm)."""
        return value

    def times_slope(self, parameter: str, value: float) -> float:
        """The derivative of a parameter's fitted value by the logarithm of what is told of it: the value itself, if the
        two do not differ."""
        return value

    def noise_time_s(self, experiment: str, channel: str) -> float:
        """Correlation time of the noise, if there are no repeats to show it. 0: only the fast noise of a record counts
        as noise, anything slower as structure."""
        return 0.0

    @property
    def correction_sites(self) -> Mapping[str, CorrectionSite]:
        return {}

    def candidate_experiments(self) -> tuple[CandidateExperiment, ...]:
        return ()
