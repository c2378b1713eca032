"""Effects that would explain part of the residual if their bounds allowed the other sign."""

from __future__ import annotations

from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.score import score
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.fit import Fit
from lacuna.system import Effect


def impossible_signs(fitted: Fit, policy: Policy) -> list[str]:
    """A sentence for each effect with one size, absent at a bound, that the residual of `fitted` would push beyond that
    bound: if to first order it removes more than the policy's share of the residual."""
    system, found = fitted.structure.system, []
    able = [name for name, e in system.effects.items() if name not in fitted.structure.effects and e.sizes == 1]
    able = [name for name in able if system.effects[name].absent in _bounds(system.effects[name])]
    for one in score(fitted, able, Workers(lambda _: None)).screened() if able else ():
        if one.wrong_sign > policy.share:
            effect = system.effects[one.effect]
            size = effect.parameters[0]
            told, typical = (system.told(effect.full_name(size), value) for value in (effect.absent, size.value))
            side, bound = "below" if told < typical else "above", f"{told:g} {size.unit}".rstrip()
            found.append(f"{one.effect} would fit with a {size.name} {side} {bound}, which its bounds forbid.")
    return found


def _bounds(effect: Effect) -> tuple[float, float]:
    return effect.parameters[0].lower, effect.parameters[0].upper
