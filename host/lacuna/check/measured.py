"""Checks of records for data that cannot be compared with a prediction."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from lacuna.check.numbers import SAME, first, spread
from lacuna.errors import MisuseError
from lacuna.records import describe_reversal
from lacuna.system import Record, by_channel

_FEWEST_SAMPLES = 8


def check_record(trial: Record) -> None:
    time = np.asarray(trial.time_s)
    if time.ndim != 1 or time.dtype.kind not in "fiu":
        raise MisuseError(f"trial {trial.name}: its times are not a sequence of numbers.")
    if len(time) < _FEWEST_SAMPLES:
        raise MisuseError(
            f"trial {trial.name} has {len(time)} samples: a record needs at least {_FEWEST_SAMPLES}. Rows of a static"
            " table belong together in one record."
        )
    if not np.isfinite(time).all():
        raise MisuseError(f"trial {trial.name}: time at sample {first(~np.isfinite(time))} is not a number.")
    if said := describe_reversal(time):
        raise MisuseError(f"trial {trial.name}: {said}.")
    if not trial.channels:
        raise MisuseError(f"trial {trial.name} has no channel to compare a prediction with.")
    for name, column in trial.channels.items():
        where = f"trial {trial.name}, channel {name}"
        column = np.asarray(column)
        if column.dtype.kind not in "fiu":
            raise MisuseError(f"{where}: measured values are {column.dtype}, not real numbers.")
        if column.shape != time.shape:
            raise MisuseError(f"{where}: measured with shape {column.shape}, but the times have {time.shape}.")
        if np.isinf(column).any():
            raise MisuseError(f"{where}: infinite at sample {first(np.isinf(column))}; mark missing samples as NaN.")
        if np.isfinite(column).sum() < _FEWEST_SAMPLES:
            raise MisuseError(
                f"{where}: fewer than {_FEWEST_SAMPLES} valid samples. Give the record as a lacuna.Record whose"
                " `channels` leave it out."
            )


def check_columns(trials: Sequence[Record]) -> None:
    """Raise MisuseError if an input that is sampled like the times in one trial has another length in some trial."""
    sampled = {n for t in trials for n, column in t.inputs.items() if np.shape(column)[:1] == t.time_s.shape}
    for trial in trials:
        for name, column in trial.inputs.items():
            if name in sampled and np.ndim(column) and len(column) != len(trial.time_s):
                raise MisuseError(
                    f"trial {trial.name}, input {name}: {len(column)} values, but there are {len(trial.time_s)} times."
                )


def gaps_in_inputs(trials: Sequence[Record]) -> Iterable[str]:
    """Warn of missing samples in inputs: a missing output sample is merely left out of the comparison, but without an
    input sample the model may be unable to continue."""
    for trial in trials:
        for name, column in trial.inputs.items():
            column = np.asarray(column)
            if column.dtype.kind == "f" and not np.isfinite(column).all():
                at = f" at sample {first(~np.isfinite(column))}" if column.ndim else ""
                where = f"Trial {trial.name}, input {name}"
                yield f"{where}: no number{at}; a model that uses this input cannot predict from there on."


def check_constant(trials: Sequence[Record]) -> None:
    for (experiment, channel), members in by_channel(trials).items():
        columns = [trial.channels[channel] for trial in members]
        if not any(spread(column) > SAME * np.nanmax(np.abs(column)) for column in columns):
            raise MisuseError(
                f"trial {members[0].name}, channel {channel}: constant, as in every trial of {experiment};"
                " there is nothing to fit. Leave it out."
            )
