"""How far predictions are off in the units of the instruments, before and after, beside what repeats differ by."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from bifa.discrepancy.diagnosis import Diagnosis
from bifa.discrepancy.errors import difference, rms
from bifa.identify.fit import Fit, evaluate_on
from bifa.identify.noise import repeat_pairs
from bifa.identify.system import Channels, Trial

_QUANTITIES = ("displacement_mm", "pressure_psi", "force_N")


def prediction_errors(found: Diagnosis) -> list[dict]:
    """RMS error of each quantity on the trials that were fitted and on the held-out ones, by the base model and by the
    final one, and the floor: the RMS of what repeats differ by, over the root of 2. Plain types."""
    held_out = found.split.final
    before, after = _residuals(found.base, held_out), _residuals(found.final, held_out)
    unseen = {trial.name for trial in held_out}
    trials = (*found.final.problem.trials, *held_out)
    rows = []
    for quantity in _QUANTITIES:
        for which, counts in (("fitted", False), ("held-out", True)):
            names = [trial.name for trial in trials if (trial.name in unseen) is counts]
            pairs = [
                difference(one, other, after)
                for one, other in repeat_pairs(trials)
                if bool({one.name, other.name} & unseen) is counts
            ]
            sides = {
                "before": (before[name] for name in names),
                "after": (after[name] for name in names),
                "noise_floor": pairs,
            }
            errors = {side: rms(_only(quantity, members)) for side, members in sides.items()}
            if errors["before"] == errors["before"]:  # not NaN: the quantity was measured in these trials
                rows.append({"quantity": quantity, "trials": which} | {k: float(f"{v:.4g}") for k, v in errors.items()})
    return rows


def _residuals(fitted: Fit, held_out: tuple[Trial, ...]) -> Mapping[str, Channels]:
    return fitted.residuals() | evaluate_on(fitted, held_out).residuals()


def _only(quantity: str, members: Iterable[Channels]) -> list[Channels]:
    """Channels of one quantity: "displacement_head_mm" is one of "displacement_mm"."""
    first, last = quantity.rsplit("_", 1)
    return [{c: r for c, r in channels.items() if c.startswith(first) and c.endswith(last)} for channels in members]
