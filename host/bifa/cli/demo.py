"""`bifa demo`: the whole loop without hardware, with the real firmware in a simulated chip."""

from pathlib import Path
from typing import Annotated

import typer

from bifa.cli._options import OUT, PROFILE, QUICK, RERUN, Profile

EXAMPLES = ("bifa demo", "bifa demo --seed 3 --out out/three", "bifa demo --quick", "bifa demo --rerun diagnose")


def demo(
    out: Annotated[Path, OUT] = Path("out/demo"),
    seed: Annotated[
        int, typer.Option(min=0, help="Random seed of the robot, its undisclosed effect and all noise.")
    ] = 4,
    quick: Annotated[bool, QUICK] = False,
    profile: Annotated[Profile, PROFILE] = "realistic",
    rerun: Annotated[list[str], RERUN] = [],  # noqa: B006
) -> None:
    """Characterise a virtual robot with an undisclosed effect, find the effect, optimise the gait, walk, compare."""
    from bifa.cli.campaign import campaign

    campaign(out, "virtual", seed, quick, profile=profile, rerun=rerun)
