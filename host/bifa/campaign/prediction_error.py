"""How far predictions are off in the units of the instruments, before and after, beside what repeats differ by."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.diagnosis.residual_error import repeat_differences, rms
from lacuna.estimation.fit import evaluate_on
from lacuna.system import Channels

_QUANTITIES = ("displacement_mm", "pressure_psi", "force_N")


def prediction_errors(found: Diagnosis) -> list[dict[str, Any]]:
    """RMS error of each quantity on the trials that were fitted and on the held-out ones, by the base model and by the
    final one, and the floor: the RMS of what repeats differ by, over the root of 2. Plain types."""
    known, held_out = found.final.problem.trials, found.split.not_fitted
    before, after = (fit.residuals() | evaluate_on(fit, held_out).residuals() for fit in (found.base, found.final))
    floors = repeat_differences(known, held_out, after)
    rows = []
    for quantity in _QUANTITIES:
        for which, trials, floor in zip(("fitted", "held-out"), (known, held_out), floors, strict=True):
            sides = {
                "before": [before[trial.name] for trial in trials],
                "after": [after[trial.name] for trial in trials],
                "noise_floor": floor,
            }
            errors = {side: rms(_only(quantity, members)) for side, members in sides.items()}
            if math.isfinite(errors["before"]):  # the quantity was measured in these trials
                rows.append({"quantity": quantity, "trials": which} | {k: float(f"{v:.4g}") for k, v in errors.items()})
    return rows


def _only(quantity: str, members: Sequence[Channels]) -> list[Channels]:
    """Channels of one quantity: "displacement_head_mm" is one of "displacement_mm"."""
    first, last = quantity.rsplit("_", 1)
    return [{c: r for c, r in channels.items() if c.startswith(first) and c.endswith(last)} for channels in members]
