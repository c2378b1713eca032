"""`bifa demo`: the robot walks without hardware, the real firmware in a simulated chip."""

from pathlib import Path
from typing import Annotated

import typer

EPILOG = """Examples:  bifa demo   |   bifa demo --out out/mine --seed 3   |   bifa demo --rerun walk"""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog=EPILOG)(demo)


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the data set, the figure and the speeds.")] = Path("out/demo"),
    port: Annotated[str, typer.Option(help="`virtual`, or a serial port with a motion capture behind it.")] = "virtual",
    cycles: Annotated[int, typer.Option(min=4, max=100, help="Cycles of each gait.")] = 6,
    seed: Annotated[int, typer.Option(help="Seed of the virtual robot's noise.")] = 0,
    rerun: Annotated[list[str], typer.Option(help="Run this stage again although it is up to date.")] = [],  # noqa: B006
) -> None:
    """Walk the baseline gait and an optimised one, compare their speeds, draw both."""
    import json

    from rich.console import Console
    from rich.table import Table

    from bifa.campaign.progress import stage_progress
    from bifa.campaign.stages import run_stages
    from bifa.campaign.walks import walks_stage
    from bifa.gait.measured import SETTLE_CYCLES
    from bifa.rig import open_rig
    from bifa.robot import nominal
    from bifa.robot.gait import BASELINE, Gait

    gaits = {
        "baseline": ("baseline gait, 5.7 s", BASELINE),
        "optimised": ("optimised gait, 2.72 s", Gait(2.72, 204.5, 331.7, 0.6535, 0.439, 0.439)),
    }
    console = Console()
    with stage_progress(console) as progress:
        options = {"seed": seed} if port == "virtual" else {}
        stage = walks_stage(
            lambda: open_rig(port, **options),
            gaits,
            cycles,
            nominal(),
            {"port": port, "seed": seed},
            progress.part,
        )
        run_stages(out, [stage], rerun=rerun, on_start=progress.start, on_end=progress.end)

    measured = json.loads((out / "walks.json").read_text())
    table = Table(title=f"Speed over {cycles - SETTLE_CYCLES} settled cycles, in mm/s", title_justify="left")
    table.add_column("gait")
    for heading in ("measured", "spread", "paper"):
        table.add_column(heading, justify="right")
    for (name, (title, _)), paper in zip(gaits.items(), ("10.8", "23.3"), strict=True):
        speed = measured[name][0]
        table.add_row(title, f"{speed['mean_mm_s']:.2f}", f"{speed['spread_mm_s']:.2f}", paper)
    console.print(table)
    console.print(f"data set: {out / 'walks'}   figure: {out / 'walks.png'}", soft_wrap=True)
