"""The figures of docs/concepts.md, each from its own run: python -m benchmarks.concepts

Three show the mass on a spring of `benchmarks.systems.spring`, one a heated block whose power is limited.
"""

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter

import lacuna
from benchmarks.systems import spring
from lacuna import CandidateExperiment, Effect, Parameter, Record, Verdict
from lacuna.estimation.fit import Fit, evaluate_on
from lacuna.report.style import Palette, look

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
WIDE = (7.6, 2.7)
CHANNEL = "position_mm"
GENTLE = [(shape, size_N) for shape in ("steps", "sweep") for size_N in (1.0, 2.0)]
SAMPLE_S = 0.5  # of the heated block


def main() -> int:
    """Draw all four; print the numbers that the page quotes."""
    for name, draw in (("floor", floor), ("held-out", held_out), ("gap", gap), ("confusable", confusable)):
        with look() as palette:
            import matplotlib.pyplot as plt

            figure, says = draw(palette)
            figure.savefig(IMAGES / f"concept-{name}.png")
            plt.close(figure)
        print(f"{name}: {says}")
    return 0


def diagnosed(
    hidden: Mapping[str, float], conditions: Iterable[tuple[str, float]], spare: Sequence[float] = ()
) -> Verdict:
    """Diagnose the mass on a spring with `hidden` effects, from three runs of each condition."""
    draw = np.random.default_rng(0)
    records = [spring.measured(draw, hidden, shape, size, run) for shape, size in conditions for run in (1, 2, 3)]
    system = lacuna.System(
        spring.simulate,
        spring.PARAMETERS,
        spring.EFFECTS,
        outputs=CHANNEL,
        nuisances=spring.NUISANCES,
        spare=spare,
    )
    return lacuna.diagnose(system, records, progress=False)


def floor(palette: Palette) -> tuple[Any, str]:
    """Three runs of one condition: what their residuals share, and how they differ."""
    import matplotlib.pyplot as plt

    verdict = diagnosed({"delay.delay_s": 0.01}, GENTLE)
    trials = [t for t in verdict.system.trials if (t.experiment, t.condition) == ("sweep", 1.0)]
    left = np.array(list(_residuals(verdict.diagnosis.base, trials).values()))
    shared, sd = left.mean(0), verdict.diagnosis.search.floor.channels["sweep", CHANNEL].sd
    figure, axes = plt.subplots(1, 2, figsize=WIDE, sharey=True, layout="constrained")
    for run in left:
        axes[0].plot(trials[0].time_s, run, color=palette.before, linewidth=0.6)
        axes[1].plot(trials[0].time_s, run - shared, color=palette.before, linewidth=0.6)
    axes[0].plot(trials[0].time_s, shared, color=palette.predicted, linewidth=1.6, label="what they share")
    axes[1].axhspan(-sd, sd, color=palette.after, alpha=0.35, linewidth=0, zorder=3, label=f"floor, ± {sd:.2f} mm")
    axes[0].set_title("three runs, less what the model predicts", loc="left")
    axes[1].set_title("the same, less what they share", loc="left")
    axes[0].set_ylabel("mm")
    for axis in axes:
        axis.set_xlabel("time, s")
        axis.legend(loc="upper left")
    return figure, f"floor {sd:.3f} mm; shared, RMS {np.sqrt(np.mean(shared**2)):.3f} mm"


def held_out(palette: Palette) -> tuple[Any, str]:
    """Errors by condition of the base model, of the best wrong explanation, and of the right one."""
    import matplotlib.pyplot as plt

    conditions = [*(("steps", size) for size in (0.5, 1.0, 1.5)), ("sweep", 0.5), ("steps", 3.0), ("sweep", 3.0)]
    diagnosis = diagnosed({"quadratic_drag.drag_Ns2_m2": 4.0}, conditions, spare=[3.0]).diagnosis
    tried = {c.effects: c for c in diagnosis.search.tried}
    wrong = min((e for e in tried if e and "quadratic_drag" not in e), key=lambda e: tried[e].fitted.cost)
    shown = {(): palette.before, wrong: palette.predicted, ("quadratic_drag",): palette.after}
    trials = diagnosis.split.known + diagnosis.split.unseen
    figure, axis = plt.subplots(figsize=WIDE, layout="constrained")
    places, says = np.arange(len(conditions)), []
    for (effects, color), marker in zip(shown.items(), "osD", strict=True):
        left = _residuals(tried[effects].fitted, trials)
        runs = [[left[t.name] for t in trials if (t.experiment, t.condition) == c] for c in conditions]
        errors = [float(np.sqrt(np.mean(np.square(members)))) for members in runs]
        label = f"with {_words(effects)}" if effects else "the model as it is"
        axis.plot(places, errors, marker, color=color, markeredgecolor=palette.ink, markersize=7, label=label)
        says.append(f"{label} {', '.join(f'{e:.2f}' for e in errors)} mm")
    sd = np.mean([noise.sd for noise in diagnosis.search.floor.channels.values()])
    axis.axhline(sd, color=palette.ink, linestyle=":", label="floor")
    axis.axvspan(len(conditions) - 2.5, len(conditions) - 0.5, color=palette.quiet, alpha=0.2, linewidth=0)
    axis.text(len(conditions) - 1.5, 0.97, "never fitted", transform=axis.get_xaxis_transform(), ha="center", va="top")
    axis.set_yscale("log")
    axis.set_ylim(0.1, 100.0)
    axis.yaxis.set_major_formatter("{x:g}")
    axis.set_xlim(-0.5, len(conditions) - 0.5)
    axis.set_xticks(places, [f"{shape}\n{size:g} N" for shape, size in conditions])
    axis.set_ylabel("RMS error, mm")
    axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure, "; ".join(says)


def gap(palette: Palette) -> tuple[Any, str]:
    """The mean square error before, the share that each effect removes, and the floor."""
    import matplotlib.pyplot as plt

    verdict = diagnosed({"coulomb.force_N": 0.03, "delay.delay_s": 0.006}, GENTLE)
    before, after, least = (verdict.error[k] ** 2 for k in ("before", "after", "floor"))
    figure, axis = plt.subplots(figsize=(WIDE[0], 2.2), layout="constrained")
    rows = len(verdict.effects) + 2
    axis.barh(rows - 1, before, color=palette.before, height=0.6)
    start = before
    for row, effect in zip(range(rows - 2, 0, -1), verdict.effects, strict=True):
        closed = effect.share_of_gap * (before - least)
        axis.barh(row, -closed, left=start, color=palette.after, height=0.6)
        said = f"{100 * effect.share_of_gap:.0f} % of the gap"
        axis.text(start - closed / 2, row, said, color="white", ha="center", va="center")
        start -= closed
    axis.barh(0, after, color=palette.ink, height=0.6)
    axis.axvline(least, color=palette.ink, linestyle=":")
    axis.set_axisbelow(True)
    names = [_words([e.name]) for e in verdict.effects]
    axis.set_yticks(range(rows)[::-1], ["the model as it is", *(f"less {name}" for name in names), "completed"])
    axis.set_xlabel("mean square error in units of the floor's (dotted: the floor)")
    return figure, f"{verdict!r}; shares {', '.join(f'{e.name} {e.share_of_gap:.3f}' for e in verdict.effects)}"


def confusable(palette: Palette) -> tuple[Any, str]:
    """A block with a delayed heater or a delayed sensor: indistinguishable until its power reaches the limit."""
    import matplotlib.pyplot as plt

    verdict = _late_block()
    tried = {c.effects: c.fitted for c in verdict.diagnosis.search.tried}
    measured = max((t for t in verdict.system.trials if t.experiment == "steps"), key=lambda t: t.condition[1])
    asked = verdict.record["next_experiment"]["settings"]
    offered = next(e.trial for e in verdict.system.candidate_experiments() if e.settings == asked)
    sd = next(iter(verdict.diagnosis.search.floor.channels.values())).sd
    figure, axes = plt.subplots(1, 2, figsize=WIDE, layout="constrained")
    for axis, trial, title in zip(axes, (measured, offered), ("measured", "asked for next"), strict=True):
        sensor, heater = (
            tried[(name,)].structure.system.predict(tried[(name,)].theta, (name,), trial)["temperature_K"]
            for name in ("sensor_lag", "heater_lag")
        )
        if np.isfinite(trial.channels["temperature_K"]).all():
            axis.plot(trial.time_s, trial.channels["temperature_K"], color=palette.measured, alpha=0.4, linewidth=0.7)
        axis.plot(trial.time_s, sensor, color=palette.predicted, label="the sensor is late")
        axis.plot(trial.time_s, heater, color=palette.after, linestyle="--", label="the heater is late")
        apart = float(np.max(np.abs(sensor - heater)) / sd)
        floors = f"{apart:.0f}" if apart >= 1 else f"{apart:.1g}"
        axis.set_title(f"{title}, {trial.condition[1]:g} W: {floors} floors apart", loc="left")
        axis.set_xlabel("time, s")
    axes[0].set_ylabel("temperature, K")
    axes[0].legend(loc="lower left")
    return figure, str(verdict)


def _late_block() -> Verdict:
    """Three runs of steps and sweeps of 2 and 4 W, with larger ones available; the heater is limited to 8 W."""

    def lag(samples: np.ndarray, tau_s: float) -> np.ndarray:
        kept = np.exp(-SAMPLE_S / tau_s) if tau_s > 0 else 0.0
        return lfilter([1 - kept], [1, -kept], samples)

    def simulate(record: Any, theta: Any) -> dict[str, np.ndarray]:
        power_W = np.clip(lag(record["power_W"], theta["heater_lag.lag_s"]), -8.0, 8.0)
        block = lag(theta["gain_K_W"] * power_W, theta["tau_s"])
        return {"temperature_K": lag(block, theta["sensor_lag.lag_s"])}

    time_s = np.arange(0.0, 120.0, SAMPLE_S)
    shapes = {
        "steps": ((time_s > 10) & (time_s < 50)) * 1.0 - ((time_s > 70) & (time_s < 100)),
        "sweep": np.sin(2 * np.pi * (0.005 + 0.0002 * time_s) * time_s),
    }

    def record(shape: str, size_W: float, run: int, temperature_K: np.ndarray) -> Record:
        inputs = {"power_W": size_W * shapes[shape]}
        name = f"{shape} {size_W:g} W, run {run}"
        return Record(name, shape, (shape, size_W), time_s, {"temperature_K": temperature_K}, inputs=inputs)

    def measured(shape: str, size_W: float, run: int) -> Record:
        theta = {"gain_K_W": 0.9, "tau_s": 15.0, "heater_lag.lag_s": 3.0, "sensor_lag.lag_s": 0.0}
        clean_K = simulate({"power_W": size_W * shapes[shape]}, theta)["temperature_K"]
        return record(shape, size_W, run, clean_K + 0.05 * draw.standard_normal(len(time_s)))

    draw = np.random.default_rng(0)
    offers = [
        CandidateExperiment(shape, {"power_W": size}, record(shape, size, 0, np.full(len(time_s), np.nan)))
        for shape in shapes
        for size in (4.0, 16.0)
    ]
    system = lacuna.System(
        simulate,
        [Parameter("gain_K_W", "K/W", 0.8, 0.1, 5.0), Parameter("tau_s", "s", 12.0, 1.0, 100.0)],
        [Effect(name, Parameter("lag_s", "s", 2.0, 0.0, 20.0)) for name in ("sensor_lag", "heater_lag")],
        outputs="temperature_K",
        name="heated block",
        experiments=offers,
    )
    records = [measured(shape, size, run) for shape in shapes for size in (2.0, 4.0) for run in (1, 2, 3)]
    return lacuna.diagnose(system, records, progress=False)


def _words(effects: Sequence[str]) -> str:
    return " and ".join(effects).replace("_", " ")


def _residuals(fitted: Fit, trials: Sequence[Record]) -> dict[str, np.ndarray]:
    """Residuals by trial name, in mm."""
    return {name: channels[CHANNEL] for name, channels in evaluate_on(fitted, trials).residuals().items()}


if __name__ == "__main__":
    sys.exit(main())
