"""`bifa diagnose`: what the model lacks, from a data set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Offer the command `diagnose`."""
    app.command(
        epilog="Examples:  bifa diagnose out/bench --json verdict.json   |   "
        "bifa diagnose out/bench --out model.toml --report report.html"
    )(diagnose)


def diagnose(
    dataset: Annotated[Path, typer.Argument(help="The data set's folder.", show_default=False)],
    json: Annotated[Path | None, typer.Option(help="Write the verdict as JSON.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the model, with the effects that were found in it.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a page (HTML, self-contained) with the evidence.")] = None,
    model: Annotated[Path | None, typer.Option(help="Model to start from; otherwise the paper's nominal one.")] = None,
    seed: Annotated[int, typer.Option(help="Of the search; the same seed gives the same verdict.")] = 0,
) -> None:
    """Fit the base model, find what repeats agree on but the model does not, name its cause, add it, and
    report the error before and after on trials that were not fitted. Exit status 0 for any verdict."""
    from json import dumps

    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from bifa.characterisation.system import prepare
    from bifa.data import read_dataset
    from bifa.discrepancy.diagnosis import diagnose as run
    from bifa.discrepancy.record import as_record
    from bifa.robot import load_model, save_model

    console = Console()
    measured = read_dataset(dataset)
    with Progress(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console) as progress:
        task = progress.add_task("stiffness curves, steps and pulls, one after the other")
        system = prepare(measured, load_model(model) if model else None)
        found = run(system, seed=seed, progress=lambda what: progress.update(task, description=what))
    record = as_record(found)
    _print(console, record)
    if out is not None:
        save_model(out, system.model_at(found.final.theta, found.final.structure.effects))
        console.print(f"model: {out}. Next: bifa optimize --model {out} --out gait.toml", highlight=False)
    if json is not None:
        json.write_text(dumps(record, indent=2) + "\n")
    if report is not None:
        from bifa.report.diagnosis import diagnosis_page
        from bifa.report.page import render

        report.write_text(render(diagnosis_page(measured.name, record)))
        console.print(f"report: {report}", highlight=False)


def _print(console, record: dict) -> None:
    from rich.table import Table

    console.print(f"[bold]{record['verdict']}[/bold]")
    for effect in record["effects"]:
        values = ", ".join(f"{name} = {value:g}" for name, value in effect["parameters"].items())
        console.print(f"  {effect['name']} ({values}), probability {effect['probability']:.2f}", highlight=False)
        if effect["confusable_with"]:
            console.print(f"    not told apart from: {', '.join(effect['confusable_with'])}", highlight=False)
    console.print(record["signature"]["text"], highlight=False)
    error = record["error"]
    table = Table(title=error["unit"], title_justify="left")
    for heading in ("", "before", "after"):
        table.add_column(heading, justify="left" if not heading else "right")
    for what in ("fitted", "held_out"):
        table.add_row(what.replace("_", "-"), *(f"{error[side][what]:.2f}" for side in ("before", "after")))
    for name in error["before"]["by_experiment"]:
        table.add_row(name, *(f"{error[side]['by_experiment'][name]:.2f}" for side in ("before", "after")))
    table.add_row("noise floor", "", f"{error['noise_floor']['held_out']:.2f}")
    console.print(table)
    if record["not_detectable_here"]:
        console.print(f"Not detectable with this data: {', '.join(record['not_detectable_here'])}.", highlight=False)
    if record["next_experiment"]["experiment"]:
        n = record["next_experiment"]
        settings = ", ".join(f"{k} {v}" for k, v in n["settings"].items())
        console.print(
            f"Next: {n['experiment']} ({settings}) would separate {', '.join(n['separates'])}.", highlight=False
        )
