"""Where the residual lives: one held-out trial of every condition, before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.estimation.fit import Fit, evaluate_on
from lacuna.system import Channels

_POINTS = 400  # of a trace, enough for a small figure


def residuals(found: Diagnosis, labels: Mapping[str, str]) -> list[dict[str, Any]]:
    """For each held-out condition the channel whose residual shrank most, in standard deviations of the noise, under
    the base model and the final one; thinned. Plain types. labels: what trials are called, by file."""
    held_out = found.split.not_fitted
    before, after = evaluate_on(found.base, held_out), evaluate_on(found.final, held_out)
    shown, seen = [], set()
    for trial, old, new in zip(held_out, before.scaled_residuals(), _in_units_of(before, after), strict=True):
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


def _in_units_of(reference: Fit, fitted: Fit) -> Sequence[Channels]:
    """The scaled residuals of `fitted` in the units of `reference`'s noise floor."""
    return reference.problem.scaled(fitted.predictions())


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
