"""Result of a diagnosis on its trials, before and after: errors in the instruments' units, and traces of the
residuals."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from bifa.problem.accuracy import QUANTITIES, is_of
from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.diagnosis.residual_error import repeat_differences, rms
from lacuna.estimation.fit import evaluate_on

_POINTS = 400  # points per trace, enough for a small figure


def prediction_errors(found: Diagnosis) -> list[dict[str, Any]]:
    """RMS error of each quantity on the fitted and the held-out trials, for the base model and the final one, with the
    noise floor: RMS difference of repeats over sqrt(2). Plain types."""
    known, held_out = found.final.problem.trials, found.split.not_fitted
    before, after = (fit.residuals() | evaluate_on(fit, held_out).residuals() for fit in (found.base, found.final))
    floors = repeat_differences(known, held_out, after)
    rows = []
    for quantity in QUANTITIES:
        for which, trials, floor in zip(("fitted", "held-out"), (known, held_out), floors, strict=True):
            sides = {
                "before": [before[trial.name] for trial in trials],
                "after": [after[trial.name] for trial in trials],
                "noise_floor": floor,
            }
            errors = {
                side: rms({n: r for n, r in channels.items() if is_of(n, quantity)} for channels in members)
                for side, members in sides.items()
            }
            if math.isfinite(errors["before"]):  # the quantity was measured in these trials
                rows.append({"quantity": quantity, "trials": which} | {k: float(f"{v:.4g}") for k, v in errors.items()})
    return rows


def residuals(found: Diagnosis, labels: Mapping[str, str]) -> list[dict[str, Any]]:
    """Residuals of the base and the final model in each held-out condition, in standard deviations of the noise, on the
    channel where they shrank most; thinned. Plain types. labels: names of trials, by file."""
    held_out = found.split.not_fitted
    before, after = evaluate_on(found.base, held_out), evaluate_on(found.final, held_out)
    shown, seen = [], set()
    for trial, old, new in zip(
        held_out, before.scaled_residuals(), before.problem.scaled(after.predictions()), strict=True
    ):
        if (trial.experiment, trial.condition) in seen:
            continue
        seen.add((trial.experiment, trial.condition))
        channel = max(old, key=lambda name: _rms(old[name]) - _rms(new[name]))
        keep = slice(None, None, max(1, len(trial.time_s) // _POINTS))
        shown.append(
            {
                "trial": trial.name,
                "label": labels.get(trial.name, trial.name),
                "experiment": trial.experiment,
                "channel": channel,
                "time_s": [round(float(t), 3) for t in trial.time_s[keep]],
                "before": [round(float(v), 2) for v in np.nan_to_num(old[channel][keep])],
                "after": [round(float(v), 2) for v in np.nan_to_num(new[channel][keep])],
            }
        )
    return shown


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
