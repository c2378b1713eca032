"""Figures of a diagnosis: error before and after per experiment, and the effects' weights."""

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from lacuna.report.style import drawn


def draw_errors(error: Mapping[str, Any], path: Path | BytesIO, dark: bool = False) -> None:
    """Before against after, against the floor, on a logarithmic axis.

    error: the `error` object of `bifa diagnose --json` (contracts, section 5), RMS in units of the noise.
    """
    before, after = _bars(error["before"]), _bars(error["after"])
    names = [name for name in before if name in after]
    rows = np.arange(len(names))[::-1]
    with drawn(path, dark, (7.2, 0.55 * len(names) + 1.1)) as (axis, palette):
        for row, name in zip(rows, names, strict=True):
            axis.plot([before[name], after[name]], [row, row], color=palette.quiet, linewidth=1.5, zorder=1)
        axis.scatter(
            [before[n] for n in names], rows, s=60, color=palette.before, edgecolor=palette.ink, label="base model"
        )
        axis.scatter([after[n] for n in names], rows, s=60, color=palette.after, label="after", zorder=3)
        axis.axvline(error["noise_floor"]["held_out"], color=palette.ink, linestyle=":", label="noise floor")
        axis.set_xscale("log")
        axis.set_yticks(rows, names)
        axis.set_ylim(-0.6, len(names) - 0.4)
        axis.set_xlabel("RMS residual in units of the noise")
        axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def draw_weights(effects: Sequence[Mapping[str, Any]], path: Path | BytesIO, dark: bool = False) -> None:
    """The weight of each effect named (`effects` of `bifa diagnose --json`), confusable ones beside it."""
    with drawn(path, dark, (7.2, 0.5 * max(len(effects), 1) + 0.9)) as (axis, palette):
        rows = np.arange(len(effects))[::-1]
        axis.barh(rows, [effect["probability"] for effect in effects], height=0.55, color=palette.after)
        for row, effect in zip(rows, effects, strict=True):
            confusable = ", ".join(effect["confusable_with"])
            note = f"{effect['probability']:.2f}" + (f"   indistinguishable from: {confusable}" if confusable else "")
            axis.text(effect["probability"] + 0.01, row, note, va="center")
        axis.set_yticks(rows, [effect["name"].replace("_", " ") for effect in effects])
        axis.set_xlim(0, 1.25)
        axis.set_xticks([0, 0.5, 1])
        axis.set_xlabel("weight")


def draw_learnt(curve: Mapping[str, Any], path: Path | BytesIO, dark: bool = False) -> None:
    """A curve learnt where no effect explains the data (an entry of `learnt` of `bifa diagnose --json`)."""
    with drawn(path, dark, (7.2, 2.4)) as (axis, palette):
        axis.axhline(0.0, color=palette.quiet, linewidth=0.8)
        for row, values in curve["rows"].items():
            axis.plot(np.linspace(curve["lower"], curve["upper"], len(values)), values, label=row)
        axis.set_xlabel(curve["variable"])
        axis.set_ylabel(f"added ({curve['unit']})" if curve["unit"] else "added (relative)")
        if len(curve["rows"]) > 1:
            axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _bars(side: Mapping[str, Any]) -> dict[str, float]:
    bars = {"fitted trials": side["fitted"], "trials not fitted": side["held_out"]}
    if side.get("held_out_conditions") is not None:
        bars["conditions not fitted"] = side["held_out_conditions"]
    return bars | {name.replace("_", " "): value for name, value in side.get("by_experiment", {}).items()}
