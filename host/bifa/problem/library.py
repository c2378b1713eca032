"""The robot's library of effects, converted to the engine's types."""

from __future__ import annotations

from bifa import effects
from lacuna.system import Effect, Parameter


def engine_effects() -> dict[str, Effect]:
    """All effects of `bifa.effects`, with their sizes first among the parameters."""
    return {name: _engine_effect(effect) for name, effect in effects.library().items()}


def _engine_effect(effect: effects.PhysicalEffect) -> Effect:
    ordered = sorted((p for p in effect.parameters if not p.own), key=lambda p: not p.size)
    return Effect(
        name=effect.name,
        parameters=tuple(_engine_parameter(p) for p in ordered),
        enters=effect.enters,
        experiments=effect.experiments,
        equation=effect.equation,
        source=effect.source,
        sizes=len(effect.sizes),
        own=tuple(_engine_parameter(p) for p in effect.parameters if p.own),
        freed_at=effect.freed_at,
        apart=effect.apart,
        frequency=next((p.name for p in effect.parameters if p.frequency), None),
    )


def _engine_parameter(p: effects.EffectParameter) -> Parameter:
    lower, upper = p.lower, p.upper
    # a trial's own value may be anywhere within its bounds
    scale = 0.25 * (upper - lower) if p.own else 0.3 * abs(p.typical) or 0.05 * (upper - lower)
    if p.period is not None:
        lower, upper = p.typical - 0.5 * p.period, p.typical + 0.5 * p.period
    return Parameter(
        p.name, p.unit, p.typical, lower, upper, scale=scale, source=p.meaning, periodic=p.period is not None
    )
