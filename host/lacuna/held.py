"""Parameters that are not fitted: fixed at a known value or tied to another parameter."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from numbers import Real

from lacuna.errors import DeclarationError
from lacuna.system import Effect, Parameter


@dataclass(frozen=True)
class Held:
    """Held parameters. `fixed` maps names to values, `tied` maps names to the parameter that each always equals."""

    fixed: Mapping[str, float]
    tied: Mapping[str, str]

    def __contains__(self, name: object) -> bool:
        return name in self.fixed or name in self.tied

    def fill(self, values: dict[str, float]) -> None:
        """Set the held parameters in `values`, which contains all others."""
        values.update(self.fixed)
        values.update({name: values[other] for name, other in self.tied.items()})

    def free(self, parameters: Iterable[Parameter]) -> list[Parameter]:
        """Return those of `parameters` that are fitted."""
        return [p for p in parameters if p.name not in self]

    def without(self, effect: Effect) -> Effect:
        """Return `effect` with only those of its parameters that are fitted."""
        parameters = tuple(p for p in effect.parameters if effect.full_name(p) not in self)
        frequency = effect.frequency if effect.frequency in [p.name for p in parameters] else None
        return replace(effect, parameters=parameters, frequency=frequency)

    def of(self, effects: Collection[str]) -> list[str]:
        """Names of the held parameters of the base model and of `effects`."""
        return [name for name in (*self.fixed, *self.tied) if "." not in name or name.split(".")[0] in effects]

    def check(self, parameters: Sequence[Parameter], library: Sequence[Effect]) -> None:
        """Raise DeclarationError if one of the parameters cannot be held, or not in this way."""
        sizing = {name for effect in library for name in effect.size_names}
        shaping = [(name, p) for e in library for p in e.parameters if (name := e.full_name(p)) not in sizing]
        able = dict([*((p.name, p) for p in parameters), *shaping])
        for name in (*self.fixed, *self.tied):
            if name in sizing:
                raise DeclarationError(f"{name} sets the size of an effect, so it can be neither fixed nor tied.")
            if name not in able:
                raise DeclarationError(f"fixed or tied: there is no {name}; there are {', '.join(able)}.")
        for name, value in self.fixed.items():
            if name in self.tied:
                raise DeclarationError(f"{name} is both fixed and tied: choose one of the two.")
            if not isinstance(value, Real) or not isfinite(value):
                raise DeclarationError(f"{name} is fixed at {value!r}, which is not a finite number.")
            lower, upper = able[name].lower, able[name].upper
            if not (lower <= value <= upper or able[name].periodic):
                raise DeclarationError(f"{name} is fixed at {value:g}, outside its bounds {lower:g} to {upper:g}.")
        for name, other in self.tied.items():
            if other not in able or other in self.tied:
                free = ", ".join(n for n in able if n not in self.tied)
                raise DeclarationError(f"{name} is tied to {other!r}, which is not one of {free}.")
            own, its = able[name], able[other]
            ends = (self.fixed[other],) if other in self.fixed else (its.lower, its.upper)
            if not (own.periodic or own.lower <= ends[0] <= ends[-1] <= own.upper):
                what = f"fixed at {ends[0]:g}" if other in self.fixed else f"{its.lower:g} to {its.upper:g}"
                raise DeclarationError(
                    f"{name} would follow {other} ({what}) beyond its own bounds, {own.lower:g} to {own.upper:g}."
                )
        if not self.free(parameters):
            raise DeclarationError("Every parameter of the base model is fixed or tied: leave one to be fitted.")
