"""The declarations in an effect's file, which defines an `EFFECT` and functions named after the hooks where it acts.

`bifa.simulate.hooks` lists the hooks with their arguments, docs/adding-an-effect.md what they return.
"""

from dataclasses import dataclass

from bifa.errors import BifaError

# As in bifa.data, which is not imported here.
EXPERIMENTS = ("static_loading", "step_response", "anchor_pull", "locomotion")


class EffectError(BifaError):
    """An effect's name, parameter or value is wrong; the text gives the name and the range."""


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect. `typical`: a value at which the effect is clearly visible on the paper's robot.

    A `size` parameter is 0 when the effect is absent; the others only shape it. An `own` parameter has a separate value
    in every trial. A `frequency` is searched for in the residual's spectrum. `omitted`: the value if the parameter is
    left out (as in files older than the parameter), unless that is the typical one. `period`: period of a periodic
    parameter.
    """

    name: str
    unit: str
    lower: float
    upper: float
    typical: float
    meaning: str
    size: bool = False
    own: bool = False
    frequency: bool = False
    omitted: float | None = None
    period: float | None = None


@dataclass(frozen=True)
class PhysicalEffect:
    """A physical cause that the paper's model lacks.

    `enters`: the equation and the place in it where the effect acts; `experiments`: those in which it is observable;
    `states`: number of state variables per actuator; `freed_at`: sites (`bifa.problem.sites`) where its form may differ
    from the formula; `apart`: base parameters that cannot be below another one and must exceed it for the effect to act
    (such as mu_s, which cannot be below mu_k); `unlike_cycles`: successive cycles of a gait differ.
    """

    name: str
    summary: str
    equation: str
    source: str
    enters: str
    experiments: tuple[str, ...]
    parameters: tuple[EffectParameter, ...]
    states: int = 0
    freed_at: tuple[str, ...] = ()
    apart: tuple[str, ...] = ()
    unlike_cycles: bool = False

    def __post_init__(self) -> None:
        for field, kind in (("parameters", EffectParameter), *((f, str) for f in ("experiments", "freed_at", "apart"))):
            if isinstance(alone := getattr(self, field), kind):  # a tuple of one that lacks its comma
                object.__setattr__(self, field, (alone,))
        if unknown := [name for name in self.experiments if name not in EXPERIMENTS]:
            raise EffectError(f"{self.name}: no experiment is {', '.join(unknown)}; there are {', '.join(EXPERIMENTS)}")
        if self.states not in (0, 1):
            raise EffectError(f"{self.name}: states = {self.states}, but an effect has 1 state for each actuator, or 0")
        for size in self.sizes:
            if not size.lower <= 0.0 <= size.upper:
                bounds = f"{size.lower:g} to {size.upper:g}"
                raise EffectError(f"{self.name}.{size.name} is a size, 0 if the effect is absent, but within {bounds}")

    @property
    def sizes(self) -> tuple[EffectParameter, ...]:
        """The `size` parameters, which are 0 when the effect is absent."""
        return tuple(parameter for parameter in self.parameters if parameter.size)
