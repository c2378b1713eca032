"""Where a campaign is run: a rig that is opened anew for every stage."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from bifa.rig import open_rig


@dataclass(frozen=True)
class Bench:
    """`port` as for `--port`; `options` go to a virtual rig. Every stage draws its own noise.

    `known`: what the person has measured directly, in place of what the rig declares (`bifa.measure.known`).
    """

    port: str | None = "virtual"
    seed: int = 0
    options: Mapping[str, object] = field(default_factory=dict)
    known: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_virtual(self) -> bool:
        """Whether the bench is simulated, so that it has seeds and a seal."""
        return self.port == "virtual"

    def open(self, stage: int):
        """The rig for stage number `stage`."""
        return open_rig(self.port, **self._options(stage))

    def settings(self, stage: int) -> dict[str, object]:
        """What decides the stage's data, for its provenance."""
        return {"port": self.port, **self._options(stage)}

    def _options(self, stage: int) -> dict[str, object]:
        return {**self.options, "seed": 100 * self.seed + stage} if self.is_virtual else dict(self.options)
