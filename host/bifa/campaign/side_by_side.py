"""Several campaigns side by side: models, verdicts and gaits."""

import json
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from bifa.campaign.page import ERROR_COLUMNS, GAIT_NAMES, WALKED_NAMES, errors_in_words, gait_name
from bifa.campaign.stages import changed_inputs
from bifa.errors import BifaError
from bifa.report.chart import Axis, Chart, Column, Key, Panel, Series
from bifa.report.diagnosis import BASE_MODEL, COMPLETED_MODEL, HELD_OUT, NOISE_FLOOR, RMS, verdict_sentence
from bifa.report.evidence import before_and_after
from bifa.report.page import ChartedSection, Page, PageTable
from bifa.report.words import (
    channel_words,
    effect_parameter,
    effect_words,
    gait_parameter_words,
    parameter_words,
    plain,
    quantity,
)
from bifa.robot import Model, load_model
from bifa.robot.gait import Gait, load_gait
from bifa.robot.parameters import ModelParameter

_SHADES = {"baseline": "quiet", "base": "before", "completed": "after", "edge": "ink"}
_NEEDED = {"verdict", "effects", "remainder", "gaits", "prediction_error", "error"}  # of summary.json
_APART = 2.0  # standard deviations: parameters that differ by more are marked


class CompareError(BifaError):
    """A folder holds no finished campaign, or there are fewer than two."""


@dataclass(frozen=True)
class Campaign:
    """A finished campaign. models: "base" and "completed"; gaits: by name, without the baseline."""

    name: str
    summary: Mapping[str, Any]
    models: Mapping[str, Model]
    gaits: Mapping[str, Gait]


def read_runs(folders: Sequence[Path]) -> list[Campaign]:
    """Read the campaigns in these folders, named after them, or by their paths if two names are equal."""
    if len(folders) < 2:
        raise CompareError("compare needs two campaigns or more: bifa compare out/monday out/tuesday")
    names = [folder.resolve().name for folder in folders]
    if len(set(names)) < len(names):
        names = [str(folder) for folder in folders]
    return [_read(name, folder) for name, folder in zip(names, folders, strict=True)]


def _read(name: str, folder: Path) -> Campaign:
    if folder.is_file():
        raise CompareError(f"{folder} is a file, not a campaign's folder: name only folders")
    try:
        summary = dict(json.loads((folder / "summary.json").read_text()))
        if missing := sorted(_NEEDED - summary.keys()):
            raise ValueError(f"it lacks {', '.join(missing)}")
    except FileNotFoundError:
        raise CompareError(
            f"{folder} holds no finished campaign (no summary.json); finish it with: "
            f"bifa campaign --out {shlex.quote(str(folder))}"
        ) from None
    except (ValueError, TypeError) as error:
        raise CompareError(f"{folder / 'summary.json'} is damaged ({error}); rebuild it with --rerun compare") from None
    if changed := changed_inputs(folder, "compare"):
        raise CompareError(
            f"{folder} holds an unfinished campaign: {', '.join(changed)} changed after the last summary; finish it "
            "with the command that it was begun with"
        )
    which = ("base", "completed")
    models = {w: load_model(folder / f"model-{w}.toml") for w in which}
    return Campaign(name, summary, models, {w: load_gait(folder / f"gait-{w}.toml") for w in which})


def compare_page(runs: Sequence[Campaign]) -> Page:
    """Build the page that compares the campaigns."""
    verdicts = [f"{run.name}: {verdict_sentence(run.summary)}" for run in runs]
    gaits = [gait_table(runs, which) for which in runs[0].gaits]
    marks = (
        "Parameters of the completed models; ≠ marks those that differ between two runs by more than their "
        "uncertainties allow."
    )
    return Page(
        f"{len(runs)} campaigns side by side",
        _lead(runs),
        [
            ChartedSection("Verdicts", verdicts, [error_table(runs)], [_errors(runs)]),
            ChartedSection("Gaits", tables=gaits, charts=[_speeds(runs)]),
            ChartedSection("Models", [marks], [parameter_table(runs)]),
        ],
        (f"{BASE_MODEL} {COMPLETED_MODEL} {RMS} {NOISE_FLOOR} {HELD_OUT}",),
        (verdict_table(runs), speed_table(runs)),
    )


def _lead(runs: Sequence[Campaign]) -> str:
    found = {run.name: {effect["name"] for effect in run.summary["effects"]} for run in runs}
    shared = set.intersection(*found.values())
    every = [(gait, run.name) for run in runs for gait in run.summary["gaits"]]
    gait, where = max(every, key=lambda one: one[0]["measured"])
    walks = f"The fastest gait ({gait_name(gait)}) walks {gait['measured']:.2f} mm/s, in {where}."
    if not any(found.values()):
        return f"None of them named an effect. {walks}"
    if all(names == shared for names in found.values()):
        return f"All found the same: {_names(shared)}. {walks}"
    if shared:
        return f"All found {_names(shared)}; some found more. {walks}"
    return f"They found different effects. {walks}"


def _names(effects: Iterable[str]) -> str:
    return " and ".join(effect_words(name) for name in sorted(effects))


def _speeds_of(runs: Sequence[Campaign]) -> dict[str, list[float | None]]:
    """Measured speeds of each gait that was walked in any of the campaigns, None where it was not."""
    walked = [{gait["gait"]: gait["measured"] for gait in run.summary["gaits"]} for run in runs]
    return {gait: [one.get(gait) for one in walked] for gait in WALKED_NAMES if any(gait in one for one in walked)}


def verdict_table(runs: Sequence[Campaign]) -> PageTable:
    """Table of each campaign's verdict."""
    rows = []
    for run in runs:
        named = "; ".join(effect_words(e["name"], e["parameters"]) for e in run.summary["effects"])
        rows.append([run.name, run.summary["verdict"], named or "none"])
    return PageTable(["run", "verdict", "effects"], rows, words=True)


def speed_table(runs: Sequence[Campaign]) -> PageTable:
    """Table of the gaits' measured speeds."""
    speeds = _speeds_of(runs)
    cells = [["not walked" if speed is None else f"{speed:.2f}" for speed in each] for each in speeds.values()]
    rows = [[run.name, *row] for run, row in zip(runs, zip(*cells, strict=True), strict=True)]
    return PageTable(["measured speed, mm/s", *(WALKED_NAMES[gait] for gait in speeds)], rows)


def error_table(runs: Sequence[Campaign]) -> PageTable:
    """Table of errors on held-out trials, before and after, in the instruments' units."""
    rows = [
        [f"{run.name}: {channel_words(error['quantity'])}", *errors_in_words(error)]
        for run in runs
        for error in run.summary["prediction_error"]
        if error["trials"] == "held-out"
    ]
    return PageTable(["RMS error, held-out trials", *ERROR_COLUMNS], rows)


def parameter_table(runs: Sequence[Campaign]) -> PageTable:
    """Table of the completed models' parameters; those that differ by more than their uncertainties are marked."""
    models = [run.models["completed"] for run in runs]
    rows = []
    for name, parameter in models[0].parameters.items():
        mine = [model.parameters[name] for model in models]
        mark = " ≠" if _differ(mine) else ""
        label = parameter_words(name) + (f", {parameter.unit}" if parameter.unit else "")
        rows.append([label + mark, *(plain(p.value, 4) for p in mine)])
    for effect in sorted({name for model in models for name in model.effects}):
        keys = {key: None for model in models for key in model.effects.get(effect, {})}
        for key in keys:
            meaning, unit = effect_parameter(effect, key)
            values = (model.effects.get(effect, {}).get(key) for model in models)
            label = f"{effect_words(effect)}: {meaning}"
            rows.append([label, *("" if v is None else quantity(v, unit, 3) for v in values)])
    return PageTable(["parameter", *(run.name for run in runs)], rows)


def _differ(parameters: Sequence[ModelParameter]) -> bool:
    sure = [(p.value, p.sd) for p in parameters if p.sd]
    return any(abs(a - b) > _APART * np.hypot(sd_a, sd_b) for (a, sd_a), (b, sd_b) in combinations(sure, 2))


def gait_table(runs: Sequence[Campaign], which: str) -> PageTable:
    """Table of the parameters of the gaits found with the "base" or the "completed" model."""
    gaits = [run.gaits[which].as_dict() for run in runs]
    rows = [[gait_parameter_words(name), *(plain(gait[name], 3) for gait in gaits)] for name in gaits[0]]
    return PageTable([f"gait {GAIT_NAMES[which]}", *(run.name for run in runs)], rows)


def _errors(runs: Sequence[Campaign]) -> Chart:
    pairs = {}
    for run in runs:
        before, after, floor = (run.summary["error"][side]["held_out"] for side in ("before", "after", "noise_floor"))
        pairs[run.name] = (before / floor, after / floor)
    return before_and_after(pairs, 1.0, "Error on held-out trials of each campaign, before and after")


def _speeds(runs: Sequence[Campaign]) -> Chart:
    rows = np.arange(len(runs), 0, -1, dtype=float)
    speeds = {gait: np.array(each, dtype=float) for gait, each in _speeds_of(runs).items()}
    walked = {gait: np.isfinite(each) for gait, each in speeds.items()}
    series = [
        Series((WALKED_NAMES[gait],), each[walked[gait]], rows[walked[gait]], _SHADES[gait], "dots")
        for gait, each in speeds.items()
    ]
    top = max(float(s.x.max()) for s in series)
    panel = Panel(
        series,
        Axis("measured speed, mm/s", (0.0, 1.1 * top)),
        Axis(range=(0.4, len(runs) + 0.6), ticks=dict(zip([r.name for r in runs], rows.tolist(), strict=True))),
        height=0.3 * len(runs) + 0.2,
    )
    keys = [Key(WALKED_NAMES[gait], _SHADES[gait], "dots") for gait in speeds]
    return Chart([Column([panel])], keys, "Measured speed of each gait in each campaign", across=1)
