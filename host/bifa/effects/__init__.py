"""The library of effects: mechanisms of a real robot that the paper's model lacks. Each effect is one file here."""

import importlib
import pkgutil
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType, ModuleType

from bifa.effects.effect import EffectError, EffectParameter, PhysicalEffect
from bifa.errors import check_range

__all__ = ["EffectError", "EffectParameter", "PhysicalEffect", "complete", "library", "modules"]

_NOT_AN_EFFECT = "effect"


@cache
def modules() -> Mapping[str, ModuleType]:
    """The module of each effect by the effect's name, in alphabetical order."""
    names = sorted(module.name for module in pkgutil.iter_modules(__path__) if module.name != _NOT_AN_EFFECT)
    return MappingProxyType({name: importlib.import_module(f"{__name__}.{name}") for name in names})


@cache
def library() -> Mapping[str, PhysicalEffect]:
    """All effects by name. Raises EffectError for a file that declares none of its own name."""
    return MappingProxyType({name: _declared(name, module) for name, module in modules().items()})


def _declared(name: str, module: ModuleType) -> PhysicalEffect:
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, PhysicalEffect) or effect.name != name or not name.isidentifier():
        raise EffectError(f"{name}.py must define EFFECT = PhysicalEffect(name={name!r}, ...), a name without hyphens")
    if not effect.sizes:
        raise EffectError(f"{name} does not act: no parameter is marked size=True")
    return effect


def complete(name: str, values: Mapping[str, float]) -> dict[str, float]:
    """All parameters of an effect. Omitted ones take their `omitted` value if they have one, else their typical value.
    Raises EffectError for an unknown effect or parameter, or a value out of range."""
    if name not in library():
        raise EffectError(f"{name!r} is not an effect of the library; it has {', '.join(library())}")
    known = {parameter.name: parameter for parameter in library()[name].parameters}
    unknown = [key for key in values if key not in known]
    if unknown:
        raise EffectError(f"{name} has no parameter {', '.join(unknown)}; it has {', '.join(known)}")
    full = {key: values.get(key, p.typical if p.omitted is None else p.omitted) for key, p in known.items()}
    for key, value in full.items():
        check_range(EffectError, f"{name}.{key}", value, known[key].lower, known[key].upper, known[key].unit)
    return {key: float(value) for key, value in full.items()}
