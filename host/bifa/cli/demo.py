"""`bifa demo`: the whole loop without hardware, with the real firmware in a simulated chip."""

from pathlib import Path
from typing import Annotated

import typer

from bifa.cli._options import PROFILE, RERUN, Profile, examples, stoppable

EPILOG = examples("bifa demo", "bifa demo --seed 3 --out out/three", "bifa demo --quick", "bifa demo --rerun diagnose")
QUICK_CYCLES = 6


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog=EPILOG)(demo)


def demo(
    out: Annotated[Path, typer.Option(help="Folder of all artefacts; give it again to resume.")] = Path("out/demo"),
    seed: Annotated[int, typer.Option(min=0, help="Of the robot, its undisclosed effect and all noise.")] = 4,
    quick: Annotated[bool, typer.Option("--quick", help="Only walk two gaits and compare their speeds.")] = False,
    profile: Annotated[Profile, PROFILE] = "realistic",
    rerun: Annotated[list[str], RERUN] = [],  # noqa: B006
) -> None:
    """Characterise a virtual robot with an undisclosed effect, find the effect, optimise the gait, walk, compare.

    With --quick: walk the paper's baseline gait and an optimised one on the nominal robot.
    """
    if quick:
        with stoppable(lambda: f"the current walks were discarded; those finished before are in {out}"):
            _walk_two_gaits(out, seed, rerun)
    else:
        from bifa.cli.campaign import run_campaign

        run_campaign(out, "virtual", seed, False, rerun, profile=profile)


def _walk_two_gaits(out: Path, seed: int, rerun: list[str]) -> None:
    import json

    from rich.table import Table

    from bifa.files import check_targets

    check_targets(folders=(out,))

    from bifa.campaign.progress import stage_progress
    from bifa.campaign.stages import run_stages
    from bifa.campaign.walks import walks_stage
    from bifa.rig import open_rig
    from bifa.robot import nominal
    from bifa.robot.gait import BASELINE, Gait
    from bifa.screen import Console

    gaits = {
        "baseline": ("baseline gait, 5.7 s", BASELINE),
        "optimised": ("optimised gait, 2.72 s", Gait(2.72, 204.5, 331.7, 0.6535, 0.439, 0.439)),
    }
    console = Console()
    with stage_progress(console) as progress:
        stage = walks_stage(
            lambda: open_rig("virtual", seed=seed),
            gaits,
            QUICK_CYCLES,
            nominal(),
            {"port": "virtual", "seed": seed},
            progress.update,
        )
        run_stages(out, [stage], rerun=rerun, on_start=progress.start, on_end=progress.end)

    measured = json.loads((out / "walks.json").read_text())
    table = Table(title="Speed over the settled cycles, in mm/s", title_justify="left")
    table.add_column("gait")
    for heading in ("measured", "spread", "paper"):
        table.add_column(heading, justify="right")
    for (name, (title, _)), paper in zip(gaits.items(), ("10.8", "23.3"), strict=True):
        speed = measured[name][0]
        table.add_row(title, f"{speed['mean_mm_s']:.2f}", f"{speed['spread_mm_s']:.2f}", paper)
    console.print(table)
    console.print(f"data set: {out / 'walks'}   figure: {out / 'walks.png'}", soft_wrap=True)
