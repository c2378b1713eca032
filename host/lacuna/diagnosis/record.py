"""A diagnosis as JSON, format 2."""

from __future__ import annotations

import math
from typing import Any

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.diagnosis.residual_error import Error, Floor
from lacuna.system import Correction, CorrectionSite
from lacuna.values import plain

FORMAT = 2
_TRIED = 8  # explanations listed, the best first


def as_record(diagnosis: Diagnosis) -> dict[str, Any]:
    """The diagnosis in plain types only; undefined numbers, such as an error without held-out trials, are null."""
    d = diagnosis
    return {
        "format": FORMAT,
        "verdict": d.verdict,
        "effects": [
            {
                "name": e.name,
                "form": e.form,
                "parameters": {name: _number(value) for name, value in e.parameters.items()},
                "interval_90": {name: [_number(v) for v in ends] for name, ends in e.interval.items()},
                "probability": _number(e.probability),
                "share_of_gap": _share(e.share_of_gap, d),
                "confusable_with": list(e.confusable_with),
            }
            for e in d.effects
        ],
        "base_parameters": {
            name: {"value": _number(e.value), "interval_90": [_number(v) for v in e.interval]}
            for name, e in d.base_parameters.items()
        },
        "remainder": _left(d),
        "nearest": [{"effects": list(r.effects), "share_of_gap": _share(r.share_of_gap, d)} for r in d.nearest],
        "warnings": list(d.warnings),
        "held_out": {
            "repeats": [trial.name for trial in d.split.repeats],
            "conditions": [trial.name for trial in d.split.conditions],
        },
        "error": {
            "unit": "RMS residual in units of the noise",
            "before": _error(d.before),
            "after": _error(d.after),
            "noise_floor": _sides(d.floor),
        },
        "signature": {
            "experiments": list(d.signature.experiments),
            "depends_on": list(d.signature.depends_on),
            "text": d.signature.text,
        },
        "learnt": [_curve(site, learnt) for site, learnt in d.learnt],
        "compared": [
            {
                "effects": list(c.effects),
                "worse_by": _number(c.worse_by),
                "standard_error": _number(c.standard_error),
                "weight": _number(c.weight),
            }
            for c in d.choice.compared
        ],
        "tried": [
            {"effects": list(c.effects), "error": _number(c.rms)}
            for c in sorted(d.search.tried, key=lambda c: c.cost)[:_TRIED]
        ],
        "not_detectable_here": [name for name in d.search.unseen if name not in {e.name for e in d.effects}],
        "next_experiment": {
            "separates": list(d.next.separates),
            "experiment": d.next.experiment,
            "settings": {name: plain(value) for name, value in d.next.settings.items()},
        },
        "seconds": _number(d.seconds),
    }


def _curve(site: CorrectionSite, learnt: Correction) -> dict[str, Any]:
    """A learnt curve: for each row the values added to the term, evenly spaced in the variable, `lower` to `upper`."""
    return {
        "site": site.name,
        "term": site.term,
        "unit": site.unit,
        "variable": site.variable,
        "lower": site.lower,
        "upper": site.upper,
        "rows": {row: [_number(v) for v in values] for row, values in zip(site.rows, learnt.table, strict=True)},
    }


def _left(d: Diagnosis) -> dict[str, Any]:
    """What the named effects leave. `times_floor`: RMS of what repeats share, in floors, where that is largest."""
    left = d.left
    return {
        "matters": left.matters,
        "share_of_gap": _share(left.share_of_gap, d) if d.effects else 1.0,
        "times_floor": _number(math.sqrt(max(left.remainder.largest, 0.0))),
        "experiments": list(dict.fromkeys(experiment for experiment, _ in left.remainder.found)),
        "depends_on": list(left.signature.depends_on),
        "learnt": [site.name for site, _ in d.learnt],
        "cannot_tell": list(left.remainder.cannot_tell),
        "text": left.signature.text,
    }


def _error(error: Error) -> dict[str, Any]:
    by_experiment = {name: _number(value) for name, value in error.by_experiment.items()}
    return _sides(error) | {"by_experiment": by_experiment}


def _sides(error: Error | Floor) -> dict[str, Any]:
    return {name: _number(getattr(error, name)) for name in ("fitted", "held_out", "held_out_conditions")}


def _share(share: float, d: Diagnosis) -> float | None:
    """`share`, or None if the base model leaves no gap on the held-out trials, or none that matters (nuisances have
    absorbed what is missing), so that a share of it is meaningless."""
    return _number(share) if d.remainder_before.matters and d.before.held_out > d.floor.held_out else None


def _number(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None
