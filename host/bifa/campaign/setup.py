"""Settings of a campaign: the rig it runs on, opened for every stage that measures, and how much it measures."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field

from bifa.measure.by_hand import ByHand
from bifa.rig import Rig, is_offered, open_rig


@dataclass(frozen=True)
class Effort:
    """How much is measured: `quick` measures each condition twice instead of three times, and faster."""

    quick: bool = False
    cycles: int = 7
    repeats: int = 3


@dataclass(frozen=True)
class Setup:
    """The rig of a campaign. port: as for `--port`; options: of a virtual rig. Every stage draws its own noise.

    known: values that the person has measured directly, which override those the rig declares
    (`bifa.measure.bench_file`). hands: the person who works the lab's instruments; a serial port has none of its own.
    """

    port: str = "virtual"
    seed: int = 0
    options: Mapping[str, object] = field(default_factory=dict)
    known: Mapping[str, float] = field(default_factory=dict)
    hands: ByHand | None = None

    @property
    def is_by_hand(self) -> bool:
        """Whether a person works the instruments: the port is not a rig with instruments of its own."""
        return not is_offered(self.port)

    @property
    def is_virtual(self) -> bool:
        """Whether the robot is simulated and so has seeds and a seal. A real one is measured again only on request, and
        earlier data are kept next to the new."""
        return self.port == "virtual"

    def open(self, stage: int) -> Rig:
        """Open the rig for stage number `stage`."""
        return open_rig(self.port, **self._options(stage))

    def settings(self, stage: int) -> dict[str, object]:
        """Settings that decide the stage's data, for its provenance."""
        if self.is_by_hand:  # the port's name changes from day to day
            return {"port": "serial", "instruments": "by hand"}
        return {"port": self.port, **self._options(stage)}

    def _options(self, stage: int) -> dict[str, object]:
        return {**self.options, "seed": 100 * self.seed + stage} if self.is_virtual else dict(self.options)


def about(setup: Setup, effort: Effort) -> tuple[str, list[tuple[str, str]]]:
    """Describe the robot and how the campaign was made; the same settings give the same text."""
    words = ["bifa", "campaign", "--port", setup.port]
    if setup.is_virtual or setup.seed:  # the seed of searches and diagnosis counts on any rig
        words += ["--seed", str(setup.seed)]
    if "profile" in setup.options:
        words += ["--profile", str(setup.options["profile"])]
    if effort.quick:
        words.append("--quick")
    for name, value in setup.known.items():
        words += ["--known", f"{name}={value!r}"]
    robot = f"virtual robot {setup.seed}" if setup.is_virtual else f"robot on {setup.port}"
    made = [("robot", robot), ("command", shlex.join(words))]
    if setup.is_virtual:
        made.append(("seed", str(setup.seed)))
    return robot, made
