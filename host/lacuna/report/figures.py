"""Figures of a diagnosis: overview, errors, explanations tried, weights, learnt curves, traces of held-out records."""

from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import Any

import numpy as np

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.estimation.fit import evaluate_on
from lacuna.report.style import Palette, drawn, look
from lacuna.system import Channels, Record

_SHOWN = 2  # records
_TRIED = 6


def overview(record: Mapping[str, Any], diagnosis: Diagnosis) -> Any:
    """Return the overview of a verdict, drawn with the current Matplotlib backend."""
    with look() as palette:
        import matplotlib.pyplot as plt

        shown = _held_out(diagnosis)[:_SHOWN]
        figure = plt.figure(figsize=(9.6, 3.0 + 2.1 * len(shown)), layout="constrained")
        rows = figure.add_gridspec(1 + len(shown), 2, height_ratios=[1.3, *([1.0] * len(shown))])
        _tried_on(figure.add_subplot(rows[0, :]), palette, record)
        for row, one in enumerate(shown, start=1):
            _traces_on([figure.add_subplot(rows[row, 0]), figure.add_subplot(rows[row, 1])], palette, one, row == 1)
        return figure


def draw_held_out(diagnosis: Diagnosis, stream: BytesIO, dark: bool = False) -> None:
    """Draw measured and predicted traces, and residuals, of the records that the base model predicts worst."""
    shown = _held_out(diagnosis)[: _SHOWN + 1]
    size = (9.0, 1.9 * len(shown))
    with drawn(stream, dark, size, len(shown), 2, squeeze=False) as (axes, palette):
        for k, (pair, one) in enumerate(zip(axes, shown, strict=True)):
            _traces_on(list(pair), palette, one, k == 0)


def draw_tried(record: Mapping[str, Any], stream: BytesIO, dark: bool = False) -> None:
    """Draw the error that each explanation tried leaves, on a logarithmic axis."""
    with drawn(stream, dark, (7.2, 0.4 * min(len(record["tried"]), _TRIED) + 1.2)) as (axis, palette):
        _tried_on(axis, palette, record)


def _tried_on(axis: Any, palette: Palette, record: Mapping[str, Any]) -> None:
    """Draw the errors of the base model and of the best explanations tried as bars, and the floor as a line."""
    tried = [one for one in record["tried"] if one["effects"]][:_TRIED]
    base = [one for one in record["tried"] if not one["effects"]]
    rows = [*base, *tried] or [{"effects": [], "error": record["error"]["before"]["fitted"]}]
    named = {e["name"] for e in record["effects"]}
    places = np.arange(len(rows))[::-1]
    colors = [palette.after if named and set(one["effects"]) == named else palette.before for one in rows]
    axis.barh(places, [one["error"] for one in rows], height=0.6, color=colors)
    axis.axvline(1.0, color=palette.ink, linestyle=":")
    axis.set_yticks(places, [" + ".join(one["effects"]).replace("_", " ") or "the model as it is" for one in rows])
    axis.set_xscale("log")
    for which in (axis.xaxis.set_major_formatter, axis.xaxis.set_minor_formatter):
        which("{x:g}")
    axis.set_xlabel("RMS residual in units of the noise (dotted: the floor)")


def draw_errors(error: Mapping[str, Any], stream: BytesIO, dark: bool = False) -> None:
    """Draw errors before and after, and the noise floor, on a logarithmic axis. `error`: that of `as_record`."""
    before, after = _bars(error["before"]), _bars(error["after"])
    names = [name for name in before if name in after]
    rows = np.arange(len(names))[::-1]
    with drawn(stream, dark, (7.2, 0.55 * len(names) + 1.1)) as (axis, palette):
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


def draw_weights(effects: Sequence[Mapping[str, Any]], stream: BytesIO, dark: bool = False) -> None:
    """Draw the weight of each named effect (`effects` of `bifa diagnose --json`), annotated with confusable ones."""
    with drawn(stream, dark, (7.2, 0.5 * max(len(effects), 1) + 0.9)) as (axis, palette):
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


def draw_learnt(curve: Mapping[str, Any], stream: BytesIO, dark: bool = False) -> None:
    """Draw a curve learnt where no effect explains the data (an entry of `learnt` of `bifa diagnose --json`)."""
    with drawn(stream, dark, (7.2, 2.4)) as (axis, palette):
        axis.axhline(0.0, color=palette.quiet, linewidth=0.8)
        for row, values in curve["rows"].items():
            axis.plot(np.linspace(curve["lower"], curve["upper"], len(values)), values, label=row)
        axis.set_xlabel(curve["variable"])
        axis.set_ylabel(f"added ({curve['unit']})" if curve["unit"] else "added (relative)")
        if len(curve["rows"]) > 1:
            axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _held_out(diagnosis: Diagnosis) -> list[tuple[Record, str, Channels, Channels, float]]:
    """Held-out records (fitted ones if there are none), worst predicted first: each with its worst channel, the
    predictions before and after, and the floor's standard deviation of that channel."""
    trials = diagnosis.split.final or diagnosis.split.known
    before, after = (evaluate_on(fit, trials).predictions() for fit in (diagnosis.base, diagnosis.final))
    found = []
    for trial, first, last in zip(trials, before, after, strict=True):
        floor = {c: diagnosis.search.floor.of(trial.experiment, c).sd for c in trial.channels}
        error = {c: _rms(trial.channels[c] - first[c]) / floor[c] for c in trial.channels}
        worst = max(error, key=error.__getitem__)
        found.append((error[worst], (trial, worst, first, last, floor[worst])))
    return [one for _, one in sorted(found, key=lambda pair: -pair[0])]


def _traces_on(axes: Sequence[Any], palette: Palette, one: tuple[Any, ...], legend: bool) -> None:
    trial, channel, before, after, floor = one
    left, right = axes
    left.plot(trial.time_s, trial.channels[channel], color=palette.measured, linewidth=2.0, alpha=0.5, label="measured")
    left.plot(trial.time_s, before[channel], color=palette.before, label="model as it is")
    left.plot(trial.time_s, after[channel], color=palette.after, linestyle="--", label="completed")
    left.set_title(trial.name, loc="left", fontsize=8)
    left.set_ylabel(channel)
    for prediction, color in ((before, palette.before), (after, palette.after)):
        right.plot(trial.time_s, (trial.channels[channel] - prediction[channel]) / floor, color=color, linewidth=0.9)
    right.axhspan(-1, 1, color=palette.quiet, alpha=0.25, linewidth=0)
    right.set_ylabel("residual, floors")
    right.set_xlabel("time, s")
    left.set_xlabel("time, s")
    if legend:
        left.legend(loc="best", fontsize=7)


def _rms(samples: np.ndarray) -> float:
    known = samples[np.isfinite(samples)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("inf")  # no prediction at all ranks worst


def _bars(side: Mapping[str, Any]) -> dict[str, float]:
    bars = {"fitted trials": side["fitted"], "trials not fitted": side["held_out"]}
    if side.get("held_out_conditions") is not None:
        bars["conditions not fitted"] = side["held_out_conditions"]
    return bars | {name.replace("_", " "): value for name, value in side.get("by_experiment", {}).items()}
