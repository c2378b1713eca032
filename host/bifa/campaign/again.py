"""Approach the edge in steps that risk little, with walks fed back as data.

The robust gait of the completed model is walked first, then the one at the edge of what is known of it. After each
round the walks are added to the data and the model is fitted again before the next gait is sought: a walk that was
predicted narrows the uncertainty and so moves the edge; one that was not, or that failed, corrects the model.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from bifa.campaign.resolve import joined
from bifa.campaign.stages import StageError
from bifa.campaign.walks import predict, prediction_of, speed_of
from bifa.data import Dataset, Trial, read_dataset
from bifa.data.layout import TABLE_FILE
from bifa.data.write import partial_of
from bifa.files import write_text
from bifa.gait.prediction import MIN_SPEED_RATIO
from bifa.robot import Model, load_model, save_model
from bifa.robot.gait import BASELINE, Gait, load_gait, save_gait

ROUNDS = 3
_PREDICTED_REL_TOL = 0.005  # relative error of a predicted speed that is allowed even if the repeats agree more closely
_UNCHANGED_REL_TOL = 0.01  # relative difference of measured speeds that counts as none


class Ending(StrEnum):
    """Why there is no further round."""

    PREDICTED = "predicted"
    UNCHANGED = "unchanged"
    FALLS = "falls"  # with the walks among its data the model expects none of its own gaits to walk
    MOST = "most"  # the limit of rounds is reached


@dataclass(frozen=True)
class Round:
    """Prediction and measurement of one gait that was not fitted.

    predicted_mm_s, measured_mm_s: speed over settled cycles, by the model with `effects` and as measured; spread_mm_s:
    standard deviation of the repeats. error_mm: RMS error of the ends' positions along the walk; floor_mm: their noise
    floor, None for a single repeat. ended: in the last round, why there is no further one. at_edge: whether the gait
    was sought for what is known of the model, not for a spread of 2 %. interval_90_mm_s, walks_probability: as
    predicted. inside: whether the measured speed lies in the interval.
    """

    effects: tuple[str, ...]
    gait: dict[str, float]
    predicted_mm_s: float
    measured_mm_s: float
    spread_mm_s: float
    error_mm: float
    floor_mm: float | None
    ended: Ending | None = None
    at_edge: bool = False
    interval_90_mm_s: tuple[float, float] = (0.0, 0.0)
    walks_probability: float = 0.0
    inside: bool = False

    @property
    def is_predicted(self) -> bool:
        """Whether the speed is predicted to within two standard deviations of the repeats, or to half a per cent. A
        speed far below the prediction is not: the scatter of repeats of which some failed excuses no prediction."""
        error_mm_s = abs(self.predicted_mm_s - self.measured_mm_s)
        return self.measured_mm_s >= MIN_SPEED_RATIO * self.predicted_mm_s and error_mm_s <= max(
            2.0 * self.spread_mm_s, _PREDICTED_REL_TOL * abs(self.measured_mm_s)
        )

    def changes_nothing(self, before: Round) -> bool:
        """Whether the model names the same effects as before and its gait is as fast and predicted no better."""
        as_fast = abs(self.measured_mm_s - before.measured_mm_s) < _UNCHANGED_REL_TOL * before.measured_mm_s
        return self.effects == before.effects and as_fast and self.error_mm > 0.9 * before.error_mm


def read_rounds(file: Path) -> list[dict[str, Any]]:
    """Read the rounds that `again` wrote. Raises StageError if an earlier version, which recorded less, wrote them."""
    rounds = json.loads(file.read_text(encoding="utf-8"))
    known = {field.name for field in fields(Round)}
    if not rounds or any(known - set(one) for one in rounds):
        raise StageError(f"{file} was written by an earlier version; repeat the rounds with --rerun again")
    return rounds


def fastest_at_edge(rounds: Sequence[Mapping[str, Any]]) -> int | None:
    """Number of the round, from 1, whose gait at the edge is the fastest as measured; None if none was walked."""
    at_edge = [number for number, one in enumerate(rounds, 1) if one["at_edge"]]
    return max(at_edge, key=lambda number: rounds[number - 1]["measured_mm_s"], default=None)


def ending(rounds: Sequence[Round]) -> Ending | None:
    """Return why the rounds end with the last of these; None if they go on."""
    if rounds[-1].is_predicted and rounds[-1].at_edge:
        return Ending.PREDICTED
    if len(rounds) > 2 and rounds[-1].changes_nothing(rounds[-2]):
        return Ending.UNCHANGED
    return Ending.MOST if len(rounds) >= ROUNDS else None


@dataclass(frozen=True)
class RoundSteps:
    """The steps of a round.

    complete(dataset, model): fit the model before to all data, from its values; diagnose them, suspecting its effects,
    if that leaves something that matters. Returns the completed model.
    optimize(model, walked): return its gait, starting also from those walked before, or None if the model expects it
    not to walk. walk(number, model, gait, folder): walk it into a data set; rounds count from 2.
    """

    complete: Callable[[Dataset, Model], Model]
    optimize: Callable[[Model, tuple[Gait, ...]], Gait | None]
    walk: Callable[[int, Model, Gait, Path], Dataset]


def judged(model: Model, walks: Dataset, at_edge: bool = False) -> Round:
    """Judge how well `model` predicts the repeats of one gait."""
    trials = walks.trials
    prediction = prediction_of(model, trials[0])
    residuals = _residuals(model, trials)
    between = residuals - residuals.mean(axis=0)
    several = len(trials) > 1
    floor = float(np.sqrt((between**2).sum(axis=0).mean() / (len(trials) - 1))) if several else None
    measured = [speed_of(trial).mean_mm_s for trial in trials]
    return Round(
        tuple(model.effects),
        trials[0].walked,
        prediction.speed_mm_s,
        float(np.mean(measured)),
        float(np.std(measured, ddof=1)) if several else 0.0,
        float(np.sqrt(np.mean(residuals**2))),
        floor,
        at_edge=at_edge,
        interval_90_mm_s=prediction.interval_90_mm_s,
        walks_probability=prediction.walks_probability,
        inside=prediction.holds(float(np.mean(measured))),
    )


def _residuals(model: Model, repeats: Sequence[Trial]) -> np.ndarray:
    """Measured minus predicted positions in mm of the ends tracked in every repeat, shape (repeats, ends, samples), on
    the time base of the shortest repeat."""
    tracked = set.intersection(*(set(trial.columns) for trial in repeats))
    places = sorted(name for name in tracked if name.startswith("displacement"))
    shortest = min(repeats, key=lambda trial: trial.time_s[-1])
    columns = predict(model, shortest)
    predicted = np.array([columns[place] for place in places])
    measured = [[np.interp(shortest.time_s, t.time_s, t.columns[place]) for place in places] for t in repeats]
    return np.array(measured) - predicted


def _walked_in(folder: Path) -> Gait | None:
    """The gait of a round's data set, finished or not; None if it has no walk."""
    trials = read_dataset(folder).trials if (folder / TABLE_FILE).exists() else ()
    return Gait(**trials[0].walked) if trials else None


def again(inputs: Path, outputs: Path, dataset: Dataset, steps: RoundSteps) -> None:
    """Repeat rounds until a gait at the edge is predicted, nothing changes, no gait is expected to walk, or `ROUNDS` is
    reached.

    `dataset`: all data behind model-completed.toml; the walks in `inputs` are added, and those of the completed model's
    gait are the first round. Writes rounds.json, the walks of further rounds (rounds/walks-2, ...) and the models that
    sought their gaits (rounds/model-2.toml, ...), the last round's model and the fastest gait. Rounds that an
    interrupted run has already walked are not walked again.
    """
    model, found = load_model(inputs / "model-completed.toml"), [load_gait(inputs / "gait-completed.toml")]
    walks = read_dataset(inputs / "walks-completed")
    base = read_dataset(inputs / "walks-base")
    # the bench data already have walks of the baseline, of another length
    before = replace(base, trials=tuple(t for t in base.trials if Gait(**t.walked) != BASELINE))
    dataset = joined(dataset, before, "walks-1/")
    began = tuple({Gait(**trial.walked): None for trial in before.trials})
    (outputs / "rounds").mkdir(exist_ok=True)
    rounds = [judged(model, walks)]
    while (ended := ending(rounds)) is None:
        number = len(rounds) + 1
        dataset = joined(dataset, walks, f"walks-{number - 1}/")
        file, folder = (outputs / "rounds" / name for name in (f"model-{number}.toml", f"walks-{number}"))
        # Neither fitted nor sought again once it has begun to walk: elsewhere both may end a digit away.
        gait = _walked_in(folder) or _walked_in(partial_of(folder))
        completed = load_model(file) if gait and file.exists() else steps.complete(dataset, model)
        # If no effect is left, the fits have gone wrong: the model that explained the bench data is kept.
        if model.effects and not completed.effects:
            completed = model
        gait = gait or steps.optimize(completed, (*began, *found))
        if gait is None:
            ended = Ending.FALLS
            break
        save_model(file, completed)
        walks = read_dataset(folder) if folder.exists() else steps.walk(number, completed, gait, folder)
        found.append(gait)
        model = completed
        rounds.append(judged(model, walks, at_edge=True))
    rounds[-1] = replace(rounds[-1], ended=ended)
    save_model(outputs / "model-last.toml", model)
    fastest = found[int(np.argmax([one.measured_mm_s for one in rounds]))]
    save_gait(outputs / "gait-last.toml", fastest, {"created_by": "bifa campaign"})
    write_text(outputs / "rounds.json", json.dumps([asdict(r) for r in rounds], indent=1) + "\n")
