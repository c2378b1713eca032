"""How a campaign was made, for its report: what to type to have it again."""

import shlex
from typing import TYPE_CHECKING

from bifa.campaign.bench import Bench

if TYPE_CHECKING:
    from bifa.campaign.loop import Effort

Pairs = list[tuple[str, str]]


def about(bench: Bench, effort: "Effort") -> tuple[str, Pairs]:
    """The robot in words, and how the campaign was made; the same for the same settings."""
    words = ["bifa", "campaign", "--port", bench.port]
    if bench.is_virtual:
        words += ["--seed", str(bench.seed)]
    if "profile" in bench.options:
        words += ["--profile", str(bench.options["profile"])]
    if effort.quick:
        words.append("--quick")
    for name, value in bench.known.items():
        words += ["--known", f"{name}={value!r}"]
    robot = f"virtual robot {bench.seed}" if bench.is_virtual else f"robot on {bench.port}"
    made = [("robot", robot), ("command", shlex.join(words))]
    if bench.is_virtual:
        made.append(("seed", str(bench.seed)))
    return robot, made
