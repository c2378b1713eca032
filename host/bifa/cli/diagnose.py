"""`bifa diagnose`: what the model lacks, from a data set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bifa import cluster
from bifa.cli._options import DATASET, WATCH, file_option, port_option


def register(app: typer.Typer) -> None:
    """Offer the command `diagnose`."""
    app.command(
        epilog="Examples:  bifa diagnose out/bench --json verdict.json   |   "
        "bifa diagnose out/bench --out model.toml --report report.html   |   "
        "bifa diagnose out/bench --matters displacement_mm=0.5   |   "
        "bifa diagnose out/bench --port virtual --resolve   |   bifa diagnose out/bench --dask tcp://scheduler:8786"
    )(diagnose)


def diagnose(
    dataset: Annotated[Path, DATASET],
    json: Annotated[Path | None, typer.Option(help="Write the verdict as JSON.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the model, completed by the effects found.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a page (HTML, self-contained) with the evidence.")] = None,
    model: Annotated[Path | None, file_option("Model to start from; the nominal one if left out.")] = None,
    seed: Annotated[int, typer.Option(help="Of the search; the same seed gives the same verdict.")] = 0,
    resolve: Annotated[
        bool, typer.Option("--resolve", help="Run the experiment that separates confusable effects, and continue.")
    ] = False,
    port: Annotated[
        str | None, port_option("For --resolve: `virtual` (the robot that made the data), or a serial port.")
    ] = None,
    watch: Annotated[Path | None, WATCH] = None,
    matters: Annotated[
        list[str] | None,
        typer.Option(
            help="RMS error that is good enough, such as displacement_mm=0.5; repeatable. By default a tenth of the"
            " noise floor.",
            show_default=False,
        ),
    ] = None,
    dask: Annotated[str | None, typer.Option(help=cluster.HELP)] = None,
    dask_ca: Annotated[Path | None, typer.Option(help=cluster.CA_HELP)] = None,
    dask_cert: Annotated[Path | None, typer.Option(help=cluster.CERT_HELP)] = None,
    dask_key: Annotated[Path | None, typer.Option(help=cluster.KEY_HELP)] = None,
) -> None:
    """Fit the base model, find what repeats agree on but the model does not, name its cause, add it, and
    report the error before and after on trials that were not fitted. Exit status 0 for any verdict."""
    from contextlib import nullcontext

    from bifa.files import check_targets

    check_targets(json, out, report)

    from bifa.data import read_dataset
    from bifa.pipe_robot.accuracy import accuracies
    from bifa.robot import load_model
    from bifa.screen import Console

    console = Console()
    good_enough = accuracies(matters or ())
    measured = read_dataset(dataset)
    folder = dataset.with_name(dataset.name + "-resolved") if resolve else None
    workers = cluster.cluster(dask, cluster.Tls(dask_ca, dask_cert, dask_key)) if dask else nullcontext((None, 0))
    robot = load_model(model) if model else None
    found = _found(console, measured, robot, good_enough, seed, folder, port, watch, workers)
    _report(console, measured.name, found, json, out, report)


def _found(console, measured, robot, good_enough, seed: int, resolved: Path | None, port, watch, workers):
    """The diagnosis of a data set; `resolved`: with experiments that separate, recorded into this folder."""
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from bifa.campaign.resolve import resolve
    from bifa.identify.start import prepare
    from lacuna.diagnosis.diagnose import Diagnosis, diagnose

    with Progress(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn(), console=console) as progress:
        task = progress.add_task("fitting stiffness curves, steps and pulls in turn")

        def said(what: str, share: float = 0.0) -> None:
            progress.update(task, description=what)

        def diagnosed(trials) -> Diagnosis:
            system = prepare(trials, robot)
            system.accuracies = good_enough
            return diagnose(system, seed=seed, progress=said, executor=executor)

        with workers as (executor, _):
            found = diagnosed(measured)
            if resolved is not None:
                rigs = _rigs(measured, port, console, watch, progress)
                _, found, _ = resolve(measured, found, diagnosed, rigs, resolved, said)
    return found


def _report(console, measured, found, json: Path | None, model: Path | None, page: Path | None) -> None:
    """Print the diagnosis, and write what was asked for."""
    from json import dumps

    from bifa.data.dataset import labels_of
    from bifa.files import write_text
    from bifa.identify.completed import completed_model
    from bifa.report.diagnosis import diagnosis_page
    from bifa.report.page import write_page
    from bifa.robot import save_model
    from lacuna.diagnosis.record import as_record

    record = as_record(found)
    _print(console, record)
    if model is not None:
        save_model(model, completed_model(found.final))
        console.print(f"model: {model}. Next: bifa optimize --model {model} --out gait.toml", highlight=False)
    if json is not None:
        write_text(json, dumps(record, indent=2) + "\n")
    if page is not None:
        write_page(diagnosis_page(measured.name, record, labels_of(measured)), page)
        console.print(f"report: {page}", highlight=False)


def _rigs(measured, port: str | None, console, watch: Path | None, progress):
    """Opens the rig for an experiment more. A virtual robot is the one of the data set's provenance; where a person
    works the instruments, no bar redraws itself over the questions."""
    from contextlib import contextmanager

    from bifa.campaign.resolve import SPECIMEN
    from bifa.cli.campaign import at_desk
    from bifa.rig import open_rig

    made = {**measured.provenance, **measured.provenance.get("options", {})}
    options = {key: made[key] for key in SPECIMEN if key in made} if port == "virtual" else {}

    @contextmanager
    def opened(number: int):
        with open_rig(port, **options, **({"seed": 1000 + number} if port == "virtual" else {})) as rig:
            if rig.instruments is not None:
                yield rig
                return
            at_desk(console, watch)[1].equip(rig)
            progress.stop()
            yield rig
        progress.start()

    return opened


def _print(console, record: dict) -> None:
    from rich.table import Table

    console.print(f"[bold]{record['verdict']}[/bold]")
    for effect in record["effects"]:
        values = ", ".join(f"{name} = {value:g}" for name, value in effect["parameters"].items())
        console.print(
            f"  {effect['name']} ({values}), closes {100 * effect['share_of_gap']:.0f} % of the gap, "
            f"probability {effect['probability']:.2f}",
            highlight=False,
        )
        if effect["confusable_with"]:
            console.print(f"    indistinguishable from: {', '.join(effect['confusable_with'])}", highlight=False)
    console.print(record["signature"]["text"], highlight=False)
    if record["verdict"] == "identified":
        console.print(f"Left unexplained: {record['remainder']['text']}", highlight=False)
    if record["verdict"] == "unexplained" and record["nearest"]:
        near = [f"{' + '.join(r['effects'])} ({100 * r['share_of_gap']:.0f} %)" for r in record["nearest"]]
        console.print(f"Nearest, with the share of the gap that each would close: {', '.join(near)}.", highlight=False)
    for warning in record["warnings"]:
        console.print(f"Note: {warning}", highlight=False)
    error = record["error"]
    table = Table(title=error["unit"], title_justify="left")
    for heading in ("", "before", "after"):
        table.add_column(heading, justify="left" if not heading else "right")
    for what, label in (
        ("fitted", "fitted"),
        ("held_out", "not fitted"),
        ("held_out_conditions", "conditions not fitted"),
    ):
        if error["before"][what] is None:
            continue
        table.add_row(label, *(f"{error[side][what]:.2f}" for side in ("before", "after")))
    for name in error["before"]["by_experiment"]:
        table.add_row(name, *(f"{error[side]['by_experiment'][name]:.2f}" for side in ("before", "after")))
    table.add_row("noise floor", "", f"{error['noise_floor']['held_out']:.2f}")
    console.print(table)
    for curve in record["learnt"]:
        console.print(f"Learnt: a curve over {curve['variable']}, added to {curve['term']}.", highlight=False)
    if record["not_detectable_here"]:
        console.print(f"Not detectable in this data: {', '.join(record['not_detectable_here'])}.", highlight=False)
    if record["next_experiment"]["experiment"]:
        n = record["next_experiment"]
        settings = ", ".join(f"{k} {v}" for k, v in n["settings"].items())
        console.print(
            f"Next: {n['experiment']} ({settings}) would separate {', '.join(n['separates'])}.", highlight=False
        )
