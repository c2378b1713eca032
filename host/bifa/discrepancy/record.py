"""A diagnosis as JSON, format 1."""

from __future__ import annotations

import math
from typing import Any

from bifa.discrepancy.diagnosis import Diagnosis
from bifa.discrepancy.errors import Error
from bifa.identify.system import Correction, CorrectionSite

FORMAT = 1
_TRIED = 8  # explanations listed, the best first


def as_record(diagnosis: Diagnosis) -> dict[str, Any]:
    """Plain types only; numbers that do not exist (no trial held out) are null."""
    d = diagnosis
    return {
        "format": FORMAT,
        "verdict": d.verdict,
        "effects": [
            {
                "name": e.name,
                "parameters": {name: _number(value) for name, value in e.parameters.items()},
                "probability": _number(e.probability),
                "confusable_with": list(e.confusable_with),
            }
            for e in d.effects
        ],
        "held_out": [trial.name for trial in d.split.final],
        "error": {
            "unit": "RMS residual in units of the noise",
            "before": _error(d.before),
            "after": _error(d.after),
            "noise_floor": {"fitted": _number(d.floor.fitted), "held_out": _number(d.floor.held_out)},
        },
        "signature": {
            "experiments": list(d.signature.experiments),
            "depends_on": list(d.signature.depends_on),
            "text": d.signature.text,
        },
        "learnt": [_curve(site, learnt) for site, learnt in d.learnt],
        "tried": [
            {"effects": list(c.effects), "error": _number(c.rms)}
            for c in sorted(d.search.tried, key=lambda c: c.cost)[:_TRIED]
        ],
        "not_detectable_here": [s.effect for s in d.search.screened if not s.detectable],
        "next_experiment": {
            "separates": list(d.next.separates),
            "experiment": d.next.experiment,
            "settings": dict(d.next.settings),
        },
        "seconds": _number(d.seconds),
    }


def _curve(site: CorrectionSite, learnt: Correction) -> dict[str, Any]:
    """What is added to a term: a row of values each, at equal intervals from `lower` to `upper` of the variable."""
    return {
        "site": site.name,
        "term": site.term,
        "unit": site.unit,
        "variable": site.variable,
        "lower": site.lower,
        "upper": site.upper,
        "rows": {row: [_number(v) for v in values] for row, values in zip(site.rows, learnt.table, strict=True)},
    }


def _error(error: Error) -> dict[str, Any]:
    return {
        "fitted": _number(error.fitted),
        "held_out": _number(error.held_out),
        "by_experiment": {name: _number(value) for name, value in error.by_experiment.items()},
    }


def _number(value: float) -> float | None:
    return float(f"{value:.4g}") if math.isfinite(value) else None
