"""`bifa campaign`: measure, fit, find what is missing, optimise, walk, compare."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

EPILOG = """Examples:  bifa campaign --port virtual --seed 3   |   bifa campaign --quick   |
bifa campaign --rerun diagnose   |
bifa campaign --port /dev/ttyACM0 --known head_mass_kg=0.182 --known tail_mass_kg=0.171 --out out/monday"""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog=EPILOG)(campaign)


def campaign(
    out: Annotated[Path, typer.Option(help="Folder of all artefacts; name it again to resume.")] = Path("out/campaign"),
    port: Annotated[str, typer.Option(help="`virtual`, or a serial port whose rig has instruments.")] = "virtual",
    seed: Annotated[int, typer.Option(min=0, help="Of the virtual robot, its undisclosed effect, all noise.")] = 0,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer conditions, each twice.")] = False,
    known: Annotated[list[str], typer.Option(help="What you measured: NAME=VALUE, as head_mass_kg=0.182.")] = [],  # noqa: B006
    rerun: Annotated[list[str], typer.Option(help="Run this stage again even if it is up to date.")] = [],  # noqa: B006
) -> None:
    """Run the whole loop on a robot; a virtual one has an undisclosed effect.

    Every stage can be interrupted and resumed, and is run again only when something that it depends on has changed.
    What you have weighed or gauged yourself goes into --known; everything else is fitted, or stands at the nominal
    value where no experiment can tell it. A virtual robot comes with its masses and its supply pressure.
    """
    from bifa.measure.known import parse_known

    run_campaign(out, port, seed, quick, rerun, parse_known(known))


def run_campaign(
    out: Path, port: str, seed: int, quick: bool, rerun: Sequence[str], known: Mapping[str, float] | None = None
) -> None:
    """Bring all stages up to date with progress on the terminal, then print what came of it."""
    import json

    from bifa.campaign.bench import Bench
    from bifa.campaign.loop import Effort, campaign
    from bifa.campaign.page import prediction_table, speed_table
    from bifa.campaign.progress import stage_progress
    from bifa.campaign.stages import run_stages
    from bifa.report.diagnosis import noise_table
    from bifa.screen import Console

    console = Console()
    bench = Bench(port, seed, {"sealed": seed} if port == "virtual" else {}, known or {})
    with stage_progress(console) as progress:
        stages = campaign(bench, Effort(quick), progress.part)
        run_stages(out, stages, rerun=rerun, on_start=progress.start, on_end=progress.end)

    summary = json.loads((out / "summary.json").read_text())
    effects = "; ".join(_said(e["name"], e["parameters"]) for e in summary["effects"]) or "no effect"
    console.print(f"verdict: [bold]{summary['verdict']}[/bold], {effects}", highlight=False)
    if summary["truth"] is not None:
        inside = "; ".join(_said(name, values) for name, values in summary["truth"].items())
        console.print(f"the seal opened: {inside or 'nothing'}", highlight=False)
    errors = prediction_table(summary["prediction_error"]), noise_table(summary["error"])
    for table in (*errors, speed_table(summary["gaits"])):
        print_table(console, table)
    console.print(f"report: {out / 'report.html'}", highlight=False, soft_wrap=True)


def _said(name: str, values: Mapping[str, float]) -> str:
    from bifa.report.words import effect_words

    return effect_words(name, values).replace("\N{NO-BREAK SPACE}", " ")


def print_table(console, content) -> None:
    from rich.table import Table

    table = Table(title=content.caption, title_justify="left")
    for i, heading in enumerate(content.columns):
        table.add_column(heading, justify="right" if i else "left")
    for row in content.rows:
        table.add_row(*(cell.replace("\N{NO-BREAK SPACE}", " ") for cell in row))
    console.print(table)
