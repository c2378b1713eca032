"""Days in the lab with randomly drawn robots, and typical mistakes in their data."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from bifa.check.plausibility import check_plausibility
from bifa.data import Dataset, Trial, read_dataset
from virtual_robot import sealed
from virtual_robot.truths import foreign

Change = Callable[[Trial], Trial]


def drawn(folder: Path, seed: int, truth: str = "own", effect: str | None = None, size: float = 1.5) -> Dataset:
    """A sealed data set with `effect` at `size` times its modest size, or without an effect."""
    out = folder / f"{truth}_{effect}_{seed}"
    if truth == "foreign":
        kind, form = ("one" if effect else "none"), None
        foreign.generate(seed, out, kind, effect, size if effect else None, form, out.with_suffix(".sealed.toml"))
    else:
        sealed.generate(seed, out, "single" if effect else "none", effect, size)
    return read_dataset(out)


def mistaken(day: Dataset, files: str | Iterable[str], change: Change) -> Dataset:
    """The day with the trials of these files changed."""
    files = {files} if isinstance(files, str) else {*files}
    return replace(day, trials=tuple(change(trial) if trial.file in files else trial for trial in day.trials))


def said(day: Dataset) -> list[tuple[str, str | None]]:
    """Kind and file of every finding in the data set."""
    return [(found.kind, found.file) for found in check_plausibility(day)]


def with_columns(trial: Trial, **columns: np.ndarray) -> Trial:
    return replace(trial, columns=trial.columns | columns)


def rows(*part: int | None) -> Change:
    """Keep only a slice of the rows."""
    return lambda trial: with_columns(trial, **{name: values[slice(*part)] for name, values in trial.columns.items()})


def turned(*names: str) -> Change:
    """Reverse the sign of these columns, as far as the trial has them."""
    return lambda trial: with_columns(trial, **{n: -trial.columns[n] for n in names if n in trial.columns})


def exchanged(one: str, other: str) -> Change:
    """Exchange the names of two columns."""
    return lambda trial: with_columns(trial, **{one: trial.columns[other], other: trial.columns[one]})


def inverted(trial: Trial) -> Trial:
    """Write 0 for positive pressure and 1 for vacuum."""
    return with_columns(trial, **{n: 1 - v for n, v in trial.columns.items() if n.startswith("command")})


def head_only(trial: Trial) -> Trial:
    """The walk without the tail's displacement, as if only the head had been tracked."""
    return replace(trial, columns={n: v for n, v in trial.columns.items() if n != "displacement_tail_mm"})


def told(**gait: float) -> Change:
    """Declare another gait in dataset.toml."""
    return lambda trial: replace(trial, gait=trial.gait | gait)
