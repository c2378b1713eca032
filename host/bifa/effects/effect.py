"""What every effect's file declares: an `EFFECT`, and functions named after the hooks where it acts.

The hooks, their arguments and what they return are listed in `bifa.simulate.hooks`.
"""

from __future__ import annotations

from dataclasses import dataclass

from bifa.errors import BifaError


class EffectError(BifaError):
    """An effect's name, parameter or value is wrong; the text gives the name and the range."""


@dataclass(frozen=True)
class EffectParameter:
    """One number of an effect. `typical` is the size at which the effect is clearly visible on the paper's robot.

    A `size` parameter is 0 when the effect is absent; the others only shape it. An `own` parameter has a value of its
    own in every trial; a `frequency` is searched in the residual's spectrum. `omitted`: the value where it is left out,
    if not the typical one (in files older than the parameter). `period`: of a periodic value.
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

    `enters`: the equation and the place in it; `experiments`: where it can be seen at all; `states`: numbers remembered
    for each actuator; `freed_at`: where its form may differ from the formula, by the names in `bifa.problem.sites`;
    `apart`: parameters that it needs to be above those that they cannot be below; `unlike_cycles`: no cycle of a gait
    is like the one before.
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

    @property
    def sizes(self) -> tuple[EffectParameter, ...]:
        """The parameters that are 0 when the effect is absent."""
        return tuple(parameter for parameter in self.parameters if parameter.size)
