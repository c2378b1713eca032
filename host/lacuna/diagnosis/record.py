"""A diagnosis as JSON, format 2."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.values import plain

FORMAT = 2
_TRIED = 8  # explanations listed, the best first, besides the base model


def as_record(diagnosis: Diagnosis) -> dict[str, Any]:
    """The diagnosis in plain types only; undefined numbers, such as an error without held-out trials, are null."""
    d, left = diagnosis, diagnosis.left
    record: dict[str, Any] = _rounded(
        {
            "format": FORMAT,
            "verdict": d.verdict,
            "effects": [
                {
                    "name": e.name,
                    "form": e.form,
                    "parameters": e.parameters,
                    "interval_90": e.interval,
                    "probability": e.probability,
                    "share_of_gap": _share(e.share_of_gap, d),
                    "confusable_with": e.confusable_with,
                }
                for e in d.effects
            ],
            "base_parameters": {
                name: {"value": e.value, "interval_90": e.interval} for name, e in d.base_parameters.items()
            },
            "remainder": {  # what the named effects leave
                "matters": left.matters,
                "share_of_gap": _share(d.left_share, d) if d.effects else 1.0,
                # RMS of what repeats share, in floors, where that is largest
                "times_floor": math.sqrt(max(left.largest, 0.0)),
                "experiments": list(dict.fromkeys(experiment for experiment, _ in left.found)),
                "depends_on": d.left_signature.depends_on,
                "learnt": [site.name for site, _ in d.learnt],
                "cannot_tell": list(left.cannot_tell),
                "text": d.left_signature.text,
            },
            "nearest": [{"effects": r.effects, "share_of_gap": _share(r.share_of_gap, d)} for r in d.nearest],
            "warnings": d.warnings,
            "held_out": {
                "repeats": [trial.name for trial in d.split.repeats],
                "conditions": [trial.name for trial in d.split.conditions],
            },
            "error": {
                "unit": "RMS residual in units of the noise",
                "before": vars(d.before),
                "after": vars(d.after),
                "noise_floor": vars(d.floor),
            },
            "signature": {
                "experiments": d.signature.experiments,
                "depends_on": d.signature.depends_on,
                "text": d.signature.text,
            },
            "learnt": (),
            "compared": [one._asdict() for one in d.choice.compared],
            "tried": [
                {"effects": c.effects, "error": c.rms}
                for c in dict.fromkeys((*sorted(d.search.tried, key=lambda c: c.cost)[:_TRIED], d.search.base))
            ],
            "not_detectable_here": [name for name in d.search.unseen if name not in {e.name for e in d.effects}],
            "next_experiment": {"separates": d.next.separates, "experiment": d.next.experiment},
            "seconds": d.seconds,
        }
    )
    # what was declared, not computed, is not rounded
    record["next_experiment"]["settings"] = {name: plain(value) for name, value in d.next.settings.items()}
    record["learnt"] = [
        {
            "site": site.name,
            "term": site.term,
            "unit": site.unit,
            "variable": site.variable,
            "lower": site.lower,
            "upper": site.upper,
            # for each row the values added to the term, evenly spaced in the variable, `lower` to `upper`
            "rows": {row: _rounded(values) for row, values in zip(site.rows, learnt.table, strict=True)},
        }
        for site, learnt in d.learnt
    ]
    return record


def _rounded(value: Any) -> Any:
    """`value` in plain types, with six digits of every number."""
    if isinstance(value, Mapping):
        return {name: _rounded(each) for name, each in value.items()}
    if isinstance(value, tuple | list | np.ndarray):
        return [_rounded(each) for each in value]
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value


def _share(share: float, d: Diagnosis) -> float | None:
    """`share`, or None if the base model leaves no gap on the held-out trials, or none that matters (nuisances have
    absorbed what is missing), so that a share of it is meaningless."""
    return share if d.remainder_before.matters and d.before.held_out > d.floor.held_out else None
