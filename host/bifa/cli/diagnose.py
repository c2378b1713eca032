"""`bifa diagnose`: what the model lacks, from a data set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Offer the command `diagnose`."""
    app.command(
        epilog="Examples:  bifa diagnose out/bench --json verdict.json   |   "
        "bifa diagnose out/bench --out model.toml --report report.html   |   "
        "bifa diagnose out/bench --port virtual --resolve   |   bifa diagnose out/bench --dask tcp://scheduler:8786"
    )(diagnose)


def diagnose(
    dataset: Annotated[Path, typer.Argument(help="The data set's folder.", show_default=False)],
    json: Annotated[Path | None, typer.Option(help="Write the verdict as JSON.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the model, with the effects that were found in it.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a page (HTML, self-contained) with the evidence.")] = None,
    model: Annotated[Path | None, typer.Option(help="Model to start from; otherwise the paper's nominal one.")] = None,
    seed: Annotated[int, typer.Option(help="Of the search; the same seed gives the same verdict.")] = 0,
    resolve: Annotated[
        bool, typer.Option("--resolve", help="Run the experiment that separates confusable effects, and go on.")
    ] = False,
    port: Annotated[
        str | None, typer.Option(help="For --resolve: `virtual` (the robot that made the data), or a serial port.")
    ] = None,
    dask: Annotated[str | None, typer.Option(help="Address of a dask scheduler, to use its workers.")] = None,
) -> None:
    """Fit the base model, find what repeats agree on but the model does not, name its cause, add it, and
    report the error before and after on trials that were not fitted. Exit status 0 for any verdict."""
    from contextlib import nullcontext
    from json import dumps

    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from bifa.characterisation.completed import completed_model
    from bifa.characterisation.resolve import resolve as separate
    from bifa.characterisation.system import prepare
    from bifa.cluster import cluster
    from bifa.data import read_dataset
    from bifa.discrepancy.diagnosis import Diagnosis
    from bifa.discrepancy.diagnosis import diagnose as run
    from bifa.discrepancy.record import as_record
    from bifa.robot import load_model, save_model

    console = Console()
    measured = read_dataset(dataset)
    robot = load_model(model) if model else None
    with Progress(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console) as progress:
        task = progress.add_task("stiffness curves, steps and pulls, one after the other")

        def said(what: str, share: float = 0.0) -> None:
            progress.update(task, description=what)

        def diagnosed(trials) -> Diagnosis:
            return run(prepare(trials, robot), seed=seed, progress=said, executor=workers)

        with cluster(dask) if dask else nullcontext((None, 0)) as (workers, _):
            found = diagnosed(measured)
            if resolve:
                folder = dataset.with_name(dataset.name + "-resolved")
                measured, found, _ = separate(measured, found, diagnosed, _rig_of(measured, port), folder, said)
    record = as_record(found)
    _print(console, record)
    if out is not None:
        save_model(out, completed_model(found.final))
        console.print(f"model: {out}. Next: bifa optimize --model {out} --out gait.toml", highlight=False)
    if json is not None:
        json.write_text(dumps(record, indent=2) + "\n")
    if report is not None:
        from bifa.report.diagnosis import diagnosis_page
        from bifa.report.page import render

        report.write_text(render(diagnosis_page(measured.name, record)))
        console.print(f"report: {report}", highlight=False)


def _rig_of(measured, port: str | None):
    """Opens the rig for an experiment more. A virtual robot is the one of the data set's provenance."""
    from bifa.characterisation.resolve import SPECIMEN
    from bifa.rig import open_rig

    made = {**measured.provenance, **measured.provenance.get("options", {})}
    options = {key: made[key] for key in SPECIMEN if key in made} if port == "virtual" else {}
    return lambda number: open_rig(port, **options, **({"seed": 1000 + number} if port == "virtual" else {}))


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
    for curve in record["learnt"]:
        console.print(f"Learnt: a curve over {curve['variable']}, added to {curve['term']}.", highlight=False)
    if record["not_detectable_here"]:
        console.print(f"Not detectable with this data: {', '.join(record['not_detectable_here'])}.", highlight=False)
    if record["next_experiment"]["experiment"]:
        n = record["next_experiment"]
        settings = ", ".join(f"{k} {v}" for k, v in n["settings"].items())
        console.print(
            f"Next: {n['experiment']} ({settings}) would separate {', '.join(n['separates'])}.", highlight=False
        )
