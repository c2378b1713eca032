"""How a campaign was made, for its report: what to type to have it again."""

import shlex
from typing import TYPE_CHECKING

from bifa.campaign.setup import Setup

if TYPE_CHECKING:
    from bifa.campaign.loop import Effort

Pairs = list[tuple[str, str]]


def about(setup: Setup, effort: "Effort") -> tuple[str, Pairs]:
    """The robot in words, and how the campaign was made; the same for the same settings."""
    words = ["bifa", "campaign", "--port", setup.port]
    if setup.is_virtual:
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
