"""`lacuna.diagnose`: from a system and records to a verdict."""

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from operator import index
from typing import Any

import numpy as np

from lacuna.check.given import check_members
from lacuna.check.grains import grains_of
from lacuna.check.numbers import within
from lacuna.diagnosis import diagnose as engine
from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.diagnosis.policy import POLICY, Policy
from lacuna.diagnosis.signature import find_dependences
from lacuna.errors import LacunaError, MisuseError, listed
from lacuna.estimation.problem import usable_cores, use_threads
from lacuna.function_system import FunctionSystem
from lacuna.misfit import compare_at_misfit, residual_correlation_s, residual_rms
from lacuna.progress import Progress
from lacuna.records import Table, read
from lacuna.system import Record, System, several
from lacuna.verdict import Verdict

_MAX_NOISE_RATIO = 4.0  # of declared noise to the residual: a fit absorbs less than that even of few samples
_MOST = 0.5  # of the residual variance: a dependence that a verdict `none` does not hide

_log = logging.getLogger("lacuna")


def diagnose(
    system: System,
    records: Any = None,
    *,
    seed: int = 0,
    random_state: int | np.random.Generator | np.random.RandomState | None = None,
    test: Iterable[str] = (),
    starts: int = 1,
    n_jobs: int | None = None,
    executor: Executor | None = None,
    policy: Policy = POLICY,
    suspected: Iterable[str] = (),
    progress: Callable[[str], None] | bool = True,
) -> Verdict:
    """Diagnose what the model of `system` lacks, from `records`.

    - `records`: arrays, pandas, xarray, or a folder of CSV files (see `lacuna.records.read`); None for a system that
      already has trials.
    - `seed`: the same seed gives the same verdict. `random_state`: scikit-learn's name for the same, or a NumPy
      generator from which a seed is drawn.
    - `test`: names of the records that inform no choice and form the final test; by default some of each condition.
    - `starts`: number of initial points of the base model's fit.
    - `n_jobs`: number of processes that try explanations, -1 for one per core. By default one process with a thread
      per core, which suits a `simulate` that releases the GIL (NumPy, numba).
    - `executor`: an executor to use instead, from `concurrent.futures` or dask.
    - `policy`: the rules and thresholds that decide the verdict.
    - `suspected`: effects that are fitted whatever their score, because there is other evidence for them, such as a
      verdict on other records; they are judged like all others.
    - `progress`: a function called with a description of each step, or False for silence. The steps are also logged
      (`logging`, "lacuna").

    Ctrl-C during the search ends it with the best result so far. Raises MisuseError, RecordError or DeclarationError,
    naming the trial; during the search only if the model fails.
    """
    _check_arguments(starts, n_jobs, executor, policy, progress)
    seed = _seed("seed", seed) if random_state is None else _seed("random_state", random_state)
    suspects = several(suspected, str)
    if records is not None or not hasattr(system, "predict"):  # `with_records` reports that
        system = with_records(system, records)
    check_members(system)
    if names := several(test, str):
        system = _with_test(system, names)
    shown = Progress(len(system.effects)) if progress is True else progress or (lambda _: None)

    def reported(what: str) -> None:
        _log.info("%s: %s", system.name, what)
        shown(what)

    system, in_steps = _detect_grains(system)
    try:
        with _workers(n_jobs, executor) as workers:
            answer = partial(
                engine.diagnose,
                seed=seed,
                starts=starts,
                policy=policy,
                suspected=suspects,
                on_progress=reported,
                executor=workers,
            )
            found = answer(system)
            raised: Mapping[tuple[str, str], float] = {}
            if isinstance(system, FunctionSystem):
                estimates = system.estimates_noise_time and not found.is_stopped
                if estimates and any((left_s := residual_correlation_s(found)).values()):
                    system = system.with_noise_time(left_s)
                    found = answer(system)
                found, raised = compare_at_misfit(system, found, answer)
            found = _with_residual_warnings(found, system, raised, answer)
            found = replace(found, warnings=(*found.warnings, *in_steps))
    finally:
        if isinstance(shown, Progress):
            shown.end()
    verdict = Verdict(system, found)
    _log.info("%s: %r", system.name, verdict)
    return verdict


def _check_arguments(starts: Any, n_jobs: Any, executor: Any, policy: Any, progress: Any) -> None:
    """Raise MisuseError if an argument of `diagnose` is invalid."""
    if not _is_whole(starts, 1):
        raise MisuseError(f"starts is {starts!r}: give a whole number, 1 or more.")
    if n_jobs is not None and not _is_whole(n_jobs, -1):
        raise MisuseError(f"n_jobs is {n_jobs!r}: give a whole number, -1 for one per core.")
    if executor is not None and not hasattr(executor, "submit"):
        raise MisuseError(f"executor is {executor!r}, which cannot `submit`: give one of concurrent.futures.")
    if not isinstance(policy, Policy):
        raise MisuseError(f"policy is {policy!r}: give a lacuna.Policy.")
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise MisuseError(f"progress is {progress!r}: give a function, or False.")


def _is_whole(given: Any, least: int) -> bool:
    try:
        return index(given) >= least
    except TypeError:
        return False


def _seed(what: str, given: Any) -> int:
    """Return the seed given as a number, or draw one from a generator. Raises MisuseError."""
    if isinstance(given, np.random.RandomState):
        return int(given.randint(2**32, dtype=np.int64))
    if isinstance(given, np.random.Generator):
        return int(given.integers(2**32))
    if not _is_whole(given, 0):
        raise MisuseError(f"{what} is {given!r}: give a whole number that is not negative, or NumPy's generator.")
    return index(given)


def _detect_grains(system: System) -> tuple[System, list[str]]:
    """Return `system` with the step widths of parameters that act in steps, and a warning for each of them."""
    if not isinstance(system, FunctionSystem):
        return system, []
    try:
        grains = grains_of(system, system.trials)
    except LacunaError:  # an error of the model, which the check reports more clearly
        return system, []
    values = {p.name: p.value for p in system.parameters}
    for effect in system.effects.values():
        values |= effect.typical
    said = []
    for name, width in grains.items():
        steps = abs(system.told(name, values[name] + width) - system.told(name, values[name]))
        said.append(
            f"{name} changes predictions only in steps, of about {steps:.2g}: let the model interpolate between them,"
            " and it is fitted better."
        )
    return system.with_grains(grains), said


def _with_test(system: System, names: tuple[str, ...]) -> System:
    """Return `system` with these of its trials as the final test. Raises MisuseError."""
    known = {trial.name for trial in system.trials}
    for name in names:
        if name not in known:
            raise MisuseError(f"test names {name!r}, which no record is called; there are {', '.join(sorted(known))}.")
    if not isinstance(system, FunctionSystem):
        raise MisuseError(f"test: {type(system).__name__} defines its own split.")
    return system.with_test(names)


def _with_residual_warnings(
    found: Diagnosis, system: System, raised: Mapping[tuple[str, str], float], answer: Callable[[System], Diagnosis]
) -> Diagnosis:
    """Add warnings about the residual: if it is far above the floor, and if only a repeat or the user can tell whether
    it is noise. The advice is tried first, and withheld if following it would remove a named effect."""
    levels = found.search.floor.channels
    doubted = []
    for (experiment, channel), floor in raised.items():
        noise = levels[experiment, channel]
        doubt = "" if noise.repeats else ", so doubt the floor before the model; a repeat would tell"
        doubted.append(
            f"No explanation comes near the floor of {channel}{within(experiment, (e for e, _ in levels))}"
            f" ({floor:.3g}){doubt}. They were compared at a floor of {noise.sd:.3g}, a fraction of the best one's"
            " residual."
        )
    doubted += _noise_declared_too_large(found, system)
    left_s = residual_correlation_s(found) if found.left.matters and not raised else {}
    advised = {
        channel: float(f"{seconds:.2g}")
        for channel, seconds in left_s.items()
        if seconds > 0.0 and not any(system.noise_time_s(*key) for key in levels if key[1] == channel)
    }
    if found.is_stopped:
        advised = {}
    elif advised and isinstance(system, FunctionSystem) and found.effects:
        named, still = ({e.name for e in one.effects} for one in (found, answer(system.with_noise_time(advised))))
        advised = advised if named <= still else {}
    said = [
        f"The residual of {channel} has a correlation time of about {seconds:g} s. If it is noise, declare it:"
        f' noise_time_s={{"{channel}": {seconds:g}}}, or "estimated".'
        for channel, seconds in advised.items()
    ]
    if not isinstance(system, FunctionSystem):
        return replace(found, warnings=(*doubted, *found.warnings, *said))
    if not found.effects:
        said += [
            f"The residual of {channel} changes from sample to sample, as noise does that has outliers or grows with"
            f' the signal. If it is noise, declare its RMS: sensor_noise={{"{channel}": {rms:.3g}}}; if it grows with'
            " the signal, predict the logarithm (of counts, the square root)."
            for channel, rms in _white(found, left_s).items()
        ]
    if found.verdict == "none":
        hidden = [
            key
            for key, noise in levels.items()
            if not (noise.repeats or system.noise_time_s(*key) or key in found.left.found)
        ]
        said += [
            f"{100 * d.share:.0f} % of the residual variance of {d.channel} follows {' and '.join(d.quantities)},"
            " though it changes from sample to sample as noise does: if the samples are in no order, sort them by"
            " that, or repeat some of them."
            for d in find_dependences(found.base, hidden)
            if d.share > _MOST
        ]
    return replace(found, warnings=(*doubted, *found.warnings, *said))


def _noise_declared_too_large(found: Diagnosis, system: System) -> list[str]:
    """Warnings for declared noise that the residual refutes: it hides whatever is missing below it."""
    left = residual_rms(found)
    return [
        f"{channel}{within(experiment, (e for e, _ in left))} is predicted to within {left[experiment, channel]:.2g}"
        f" (RMS), though noise of {declared:.3g} is declared, which hides everything smaller: correct sensor_noise."
        for experiment, channel in left
        if (declared := system.sensor_noise(experiment, channel)) > _MAX_NOISE_RATIO * left[experiment, channel]
    ]


def _white(found: Diagnosis, left_s: Mapping[str, float]) -> dict[str, float]:
    """RMS residual of the channels in which something is left that has no correlation time and depends on nothing."""
    dependent = {d.channel for d in found.left_signature.dependences}
    left = residual_rms(found)
    keys = [key for key in found.left.found if left_s.get(key[1]) == 0.0 and key[1] not in dependent]
    return {channel: max(left[key] for key in keys if key[1] == channel) for _, channel in keys}


def with_records(system: System, records: Any) -> FunctionSystem:
    """Return `system` with these records as its trials. Raises MisuseError, RecordError."""
    if not hasattr(system, "predict"):
        raise MisuseError(f"diagnose(system, records): the first must be a System, not {type(system).__name__}.")
    if not isinstance(system, FunctionSystem):
        raise MisuseError(f"{type(system).__name__} already has trials: call diagnose(system) without records.")
    given = read(records)
    tables = [one for one in given if isinstance(one, Table)]
    outputs = system.outputs or (_outputs(system, tables[0]) if tables else ())
    trials = [one if isinstance(one, Record) else one.record(outputs) for one in given]
    return system.with_trials(trials)


def _outputs(system: FunctionSystem, table: Table) -> Sequence[str]:
    """Find the names of the outputs by calling `simulate` on one record. Raises MisuseError."""
    record = table.record(())
    run = record.payload.run if record.payload else record
    theta = {p.name: p.value for p in (*system.parameters, *system.nuisances(record))}
    try:
        found = system.simulated_whole(run, system.values(theta))
    except MisuseError:
        raise
    except Exception as error:
        raise MisuseError(f"trial {record.name}: the model raises {type(error).__name__}: {error}") from error
    if isinstance(found, Mapping):
        return tuple(found)
    columns = [name for name, c in table.columns.items() if np.shape(c) == table.time_s.shape]
    if len(columns) == 1:
        return columns
    raise MisuseError(
        f"trial {record.name}: which of its columns ({listed(columns)}) does the model predict? Give System(...,"
        " outputs=...), or return them by name, as a dict of arrays."
    )


@contextmanager
def _workers(n_jobs: int | None, executor: Executor | None) -> Iterator[Executor | None]:
    """Yield an executor: the one given, or single-threaded processes that also accept functions from a notebook."""
    if executor is not None or n_jobs in (None, 0, 1):
        yield executor
        return
    from loky import ProcessPoolExecutor

    with ProcessPoolExecutor(n_jobs if n_jobs > 0 else usable_cores(), initializer=use_threads, initargs=(1,)) as pool:
        yield pool
