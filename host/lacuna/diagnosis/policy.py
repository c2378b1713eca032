"""Every decision rule of the engine, in one place: its unit, its reason, and its origin.

Numerical constants (steps, tolerances, iterations) stay where they are used. These rules change verdicts. `origin`
is "derivation" (it follows from something else), "simulation" (tuned on the toy system and on robots with known
truth) or "convention" (a choice that others may make differently; pass another `Policy` to `diagnose`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any


def _rule(value: float, unit: str, reason: str, origin: str) -> Any:
    return field(default=value, metadata={"unit": unit, "reason": reason, "origin": origin})


@dataclass(frozen=True)
class Policy:
    """The engine's rules. Each field's metadata has `unit`, `reason` and `origin`; `table()` lists them."""

    # Is there anything that matters?
    chance: float = _rule(
        0.005,
        "probability",
        "a shared residual less likely by chance in any channel is structure: one false alarm in 200 data sets",
        "convention",
    )
    relevance: float = _rule(
        1.1**2 - 1,
        "floor's variance",
        "a model that predicts to within a tenth of the floor, RMS, is as good as the data: sqrt(1 + 0.21) = 1.1",
        "derivation",
    )
    drift_chance: float = _rule(
        0.002,
        "probability",
        "a trend over the session, over all parameters at once, against shuffled orders",
        "convention",
    )

    # Which mechanisms are supported?
    condition_chance: float = _rule(
        0.02,
        "probability",
        "an effect that nuisances follow from condition to condition meets what they have there better than some effect"
        " of the library would meet any numbers",
        "convention",
    )
    gain: float = _rule(
        8.0,
        "log-likelihood over dispersion",
        "what one more effect must gain beyond the cost of its parameters: odds of 3000 to 1",
        "convention",
    )
    unseen_gain: float = _rule(
        0.25, "of the gain required", "part of it must come from trials that were not fitted", "simulation"
    )
    share: float = _rule(
        0.15,
        "of what is left",
        "one more effect must close this share of the mean square that the smaller set leaves above the floor",
        "simulation",
    )
    share_of_gap: float = _rule(
        0.03,
        "of the base model's gap",
        "no formula holds to better than a sixth of what it explains (0.17 squared): a further effect that closes less"
        " is as likely the wrong form of the first, and goes into the remainder, unless it halves what is left",
        "simulation",
    )
    half: float = _rule(
        0.5,
        "of the gap",
        "mechanisms that together close less do not explain the data; nor does one beside a curve that does its work,"
        " if its own formula explains less",
        "convention",
    )
    confusable: float = _rule(
        0.05, "probability", "swapping in an effect at least this probable is not ruled out", "convention"
    )
    supported: float = _rule(
        0.5, "weight", "a named effect, or what may stand in its place, is in most of what was tried", "convention"
    )
    doubt: float = _rule(
        0.05,
        "probability",
        "an explanation is worse only if it is so however the conditions are resampled, but for this share of draws",
        "convention",
    )
    implausible: float = _rule(
        2.0, "log-likelihood", "cost of a parameter half its plausible range outside it", "convention"
    )

    # How far is the search worth its time?
    promising: float = _rule(
        0.05, "of what is left", "an effect that removes less in a quick fit is not fitted to convergence", "simulation"
    )
    rival: float = _rule(
        0.3,
        "of the gain that the best promises",
        "beside a set that suffices, one that promises less to first order is no rival",
        "simulation",
    )
    reach: float = _rule(
        3.0,
        "times the cost of a set that suffices",
        "rivals beyond this are not pursued: they cannot win",
        "derivation",
    )
    lost: float = _rule(
        2.0,
        "floors, RMS, on trials not fitted",
        "a fit that leaves more there, large residuals at their full size, is far from any explanation: it is not"
        " fitted to convergence before its rivals have begun, and a curve on top of it begins cold",
        "simulation",
    )

    # What is learnt?
    curve: float = _rule(
        0.1, "of what is left on unseen trials beyond noise", "what one more curve must remove", "simulation"
    )

    @classmethod
    def table(cls) -> list[tuple[str, float, str, str, str]]:
        """(name, value, unit, reason, origin) of every rule."""
        return [(f.name, f.default, *(f.metadata[k] for k in ("unit", "reason", "origin"))) for f in fields(cls)]


POLICY = Policy()
