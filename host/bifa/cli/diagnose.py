"""`bifa diagnose`: find out from a data set what the model lacks."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager, nullcontext
from datetime import date
from functools import partial
from json import dumps
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import Progress, SpinnerColumn, TimeElapsedColumn

from bifa import cluster
from bifa.cli._options import BASE_MODEL, BENCH_FILE, DATASET, WATCH, kept, port_option, requires, stoppable
from bifa.cli.campaign import at_desk
from bifa.cli.check import warn_of_findings
from bifa.files import check_targets, named, write_text
from bifa.screen import Console, passing_bars, words

if TYPE_CHECKING:
    from bifa.data import Dataset
    from bifa.rig import Rig
    from lacuna.diagnosis.diagnose import Diagnosis


EXAMPLES = (
    "bifa diagnose out/bench --json verdict.json",
    "bifa diagnose out/bench --out model.toml --report report.html",
    "bifa diagnose out/bench --matters displacement_mm=0.5",
    "bifa diagnose out/bench --suspect choked_flow",
    "bifa diagnose out/bench --port virtual --resolve",
    "bifa diagnose out/bench --dask tcp://scheduler:8786",
)


def diagnose(
    dataset: Annotated[Path, DATASET],
    json: Annotated[Path | None, typer.Option(help="Write the verdict as JSON.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the model, completed with the effects found.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML report with the evidence.")] = None,
    model: Annotated[Path | None, BASE_MODEL] = None,
    seed: Annotated[int, typer.Option(min=0, help="Random seed; the same seed gives the same verdict.")] = 0,
    resolve: Annotated[
        bool,
        typer.Option("--resolve", help="Run the experiment that separates confusable effects, and diagnose again."),
    ] = False,
    port: Annotated[
        str | None, port_option("For --resolve: `virtual` (the robot that made the data), or a serial port.")
    ] = None,
    watch: Annotated[Path | None, WATCH] = None,
    matters: Annotated[
        list[str] | None,
        typer.Option(
            help="RMS error of a channel that is good enough, such as displacement_mm=0.5; repeatable (default: a"
            " tenth of the noise floor).",
            show_default=False,
        ),
    ] = None,
    suspect: Annotated[
        list[str] | None,
        typer.Option(
            help="Effect to fit whatever its screening score, such as one that was named before; repeatable. It is"
            " judged like all others.",
            show_default=False,
        ),
    ] = None,
    dask: Annotated[str | None, typer.Option(help=cluster.HELP)] = None,
    dask_ca: Annotated[Path | None, typer.Option(help=cluster.CA_HELP)] = None,
    dask_cert: Annotated[Path | None, typer.Option(help=cluster.CERT_HELP)] = None,
    dask_key: Annotated[Path | None, typer.Option(help=cluster.KEY_HELP)] = None,
) -> None:
    """Fit the base model, find what its residuals have in common across repeats, name the cause, and add it to the
    model. Reports the error before and after on held-out trials. The exit status is 0 for any verdict."""
    from bifa.rig import check_port, is_offered

    if not resolve:
        requires("--resolve", port=port, watch=watch)
    elif is_offered(port):
        requires("a serial port", watch=watch)
    check_targets(json, out, report, inputs=(model,))
    check_port(port)

    console = Console()
    with console.status("reading"):
        from bifa.campaign import resolve as further
        from bifa.data import read_dataset
        from bifa.problem.accuracy import accuracies
        from bifa.robot import load_model

        good_enough = accuracies(matters or ())
        measured = read_dataset(dataset)
        warn_of_findings(console, measured)
    beside = named(dataset)
    resolved = beside.with_name(f"{beside.name}-resolved")  # where --resolve records
    hands = None
    if resolve:
        further.refuse_leftovers(resolved)
        hands = None if is_offered(port) else at_desk(console, watch, BENCH_FILE)[1]
    workers = cluster.cluster(dask, cluster.Tls(dask_ca, dask_cert, dask_key)) if dask else nullcontext((None, 0))
    robot = load_model(model) if model else None
    with console.status("starting"):
        from bifa.identify.doubts import with_doubts
        from bifa.identify.start import prepare
        from bifa.report.words import spoken
        from lacuna.diagnosis import diagnose as engine

    with passing_bars(console, SpinnerColumn(), words("{task.description}"), TimeElapsedColumn()) as progress:
        task = progress.add_task("fitting stiffness curves")

        def report_progress(what: str, share: float = 0.0) -> None:
            progress.update(task, description=spoken(what))

        latest: list[tuple[Dataset, Diagnosis]] = []  # the trials, and what they say

        def run_diagnosis(trials: Dataset, confusable: Collection[str] = ()) -> Diagnosis:
            system = prepare(trials, robot)
            system.accuracies = good_enough
            suspected = {*(suspect or ()), *confusable}
            found = engine.diagnose(
                system, seed=seed, suspected=suspected, on_progress=report_progress, executor=executor
            )
            latest[:] = [(trials, with_doubts(found, system))]
            return latest[0][1]

        with workers as (executor, _):
            found = run_diagnosis(measured)
            if resolve:
                rigs = partial(_opened, measured, port, progress)
                with stoppable(lambda: _kept(resolved)):
                    try:
                        further.resolve(measured, found, run_diagnosis, rigs, resolved, report_progress, hands)
                    except BaseException:  # whatever happened to the rig, report what the data say
                        progress.stop()
                        _report(console, *latest[0], json, out, report)
                        raise
    _report(console, *latest[0], json, out, report)


def _kept(resolved: Path) -> str:
    """Describe what an interrupted --resolve has left on disk, and how to go on."""
    from bifa.campaign import resolve as further

    if done := further.finished(resolved):
        return f"{resolved} keeps {', '.join(done)}; move it away to run --resolve again, which begins anew"
    return kept(resolved / "separate-1", "finished trial")


def _report(
    console: Console, measured: Dataset, found: Diagnosis, json: Path | None, model: Path | None, page: Path | None
) -> None:
    """Write the files that were asked for, then print the diagnosis: output that nobody reads must not lose it."""
    from bifa.data.dataset import labels_of
    from bifa.identify.completed import completed_model
    from bifa.report.diagnosis import diagnosis_page
    from bifa.report.page import write_page
    from bifa.robot import save_model
    from lacuna.diagnosis.record import as_record

    record, labels = as_record(found), labels_of(measured)
    if json is not None:
        write_text(json, dumps(record, indent=2) + "\n")
    if model is not None:
        save_model(model, completed_model(found.told, date.today().isoformat()))
    if page is not None:
        write_page(diagnosis_page(measured.name, record, labels, _curves(found, labels)), page)
    print_diagnosis(console, record, labels)
    if model is not None:
        command = f"bifa optimize --model {quote(str(model))} --out gait.toml"
        console.print(f"model: {model}. Next: {command}", soft_wrap=True)
    if page is not None:
        console.print(f"report: {page}")


def _curves(found: Diagnosis, labels: dict[str, str]) -> Any:
    """Plot held-out trials as measured, and as predicted by the base model and the completed one."""
    from bifa.report.compared_curves import compared_curves
    from bifa.report.evidence import BASE, COMPLETED
    from lacuna.estimation.fit import evaluate_on

    trials = found.split.not_fitted
    models = {BASE: found.base} | ({} if found.verdict == "none" else {COMPLETED: found.final})
    predictions = {name: evaluate_on(fit, trials).predictions() for name, fit in models.items()}
    return compared_curves(trials, predictions, labels)


@contextmanager
def _opened(measured: Dataset, port: str | None, progress: Progress, number: int) -> Iterator[Rig]:
    """Open the rig for further experiment `number`. A virtual robot is the one in the data set's provenance. While a
    person works the instruments, `progress` is stopped so as not to overwrite the questions."""
    from bifa.campaign.resolve import SPECIMEN
    from bifa.rig import open_rig

    options: dict[str, Any] = {}
    if port == "virtual":
        made = {**measured.provenance, **measured.provenance.get("options", {})}
        options = {key: made[key] for key in SPECIMEN if key in made} | {"seed": 1000 + number}
    with open_rig(port, **options) as rig:
        if rig.instruments is not None:
            yield rig
            return
        progress.stop()
        yield rig
    progress.start()


def print_diagnosis(console: Console, record: dict[str, Any], labels: dict[str, str]) -> None:
    """Print the record of a diagnosis in the words of its page; `labels` names the trials by file."""
    from bifa.report.diagnosis import further, lacking, noise_table, verdict_sentence
    from bifa.report.terminal import print_lines, print_sections, print_table

    console.print(str(record["verdict"]), style="bold")
    print_lines(console, [verdict_sentence(record)])
    print_table(console, noise_table(record["error"]))
    print_sections(console, [*lacking(record, labels), *further(record, labels)])
