"""Every decision rule of the engine in one place, with its unit, its reason and its origin.

These rules change verdicts; numerical constants (steps, tolerances, iterations) stay where they are used. `origin` is
"derivation" (it follows from something else), "simulation" (tuned on the toy system and on robots with known truth) or
"convention" (a choice that others may make differently; pass another `Policy` to `diagnose`).
"""

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
        "a shared residual less probable than this by chance, over all channels, is structure: one false alarm in 200"
        " data sets",
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
        "a trend over the session is a drift if shuffled orders reach it, in any parameter, less often than this",
        "convention",
    )

    # Which mechanisms are supported?
    condition_chance: float = _rule(
        0.02,
        "probability",
        "an effect must reproduce the nuisances' dependence on the condition better than any effect of the library"
        " would reproduce arbitrary numbers, but for this probability",
        "convention",
    )
    gain: float = _rule(
        8.0,
        "log-likelihood over dispersion",
        "gain required of each additional effect, beyond the cost of its parameters: odds of 3000 to 1",
        "convention",
    )
    unseen_gain: float = _rule(
        0.25, "of the gain required", "this part of it must come from trials that were not fitted", "simulation"
    )
    share: float = _rule(
        0.15,
        "of what is left",
        "each additional effect must close this share of the mean square that the smaller set leaves above the floor",
        "simulation",
    )
    share_of_gap: float = _rule(
        0.03,
        "of the base model's gap",
        "no formula is accurate to better than a sixth of what it explains (0.17 squared): a further effect that closes"
        " less may only correct the form of the first and is left to the remainder, unless it halves what is left",
        "simulation",
    )
    half: float = _rule(
        0.5,
        "of the gap",
        "mechanisms that together close less do not explain the data; an effect whose own formula closes less is"
        " dropped if a learnt curve does its work",
        "convention",
    )
    confusable: float = _rule(
        0.05, "probability", "a rival set less probable than this against the chosen one is ruled out", "convention"
    )
    supported: float = _rule(
        0.5, "weight", "a named effect, or a substitute for it, must have at least this weight", "convention"
    )
    doubt: float = _rule(
        0.05,
        "probability",
        "an explanation is worse only if it is so in all but this share of draws when conditions are resampled",
        "convention",
    )
    implausible: float = _rule(
        2.0, "log-likelihood", "cost of a parameter outside its plausible range by half that range", "convention"
    )

    # How much searching is worthwhile?
    promising: float = _rule(
        0.05, "of what is left", "an effect that removes less in a coarse fit is not fitted further", "simulation"
    )
    rival: float = _rule(
        0.3,
        "of the gain that the best promises",
        "once a set suffices, only sets that promise more than this to first order are still fitted as rivals",
        "simulation",
    )
    reach: float = _rule(
        3.0,
        "times the cost of a set that suffices",
        "rivals that cost more cannot win and are not pursued",
        "derivation",
    )
    lost: float = _rule(
        2.0,
        "floors, RMS, on trials not fitted",
        "a fit that leaves more, without compression of large residuals, is far from any explanation: its rivals are"
        " fitted coarsely before it is fitted to convergence, and a curve on top of it is also fitted cold",
        "simulation",
    )

    # What is learnt?
    curve: float = _rule(
        0.1, "of what is left beyond noise on trials not fitted", "what each curve must remove", "simulation"
    )

    @classmethod
    def table(cls) -> list[tuple[str, float, str, str, str]]:
        """(name, value, unit, reason, origin) of every rule."""
        return [(f.name, f.default, *(f.metadata[k] for k in ("unit", "reason", "origin"))) for f in fields(cls)]


POLICY = Policy()
