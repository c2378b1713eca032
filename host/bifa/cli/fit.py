"""`bifa fit`: fit the model's parameters to a data set, with their uncertainty."""

import shlex
import time
from datetime import date
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import SpinnerColumn, TimeElapsedColumn

from bifa.cli._options import BASE_MODEL, DATASET, PICTURES, REPORT
from bifa.cli.check import warn_of_findings
from bifa.files import check_targets, written_into
from bifa.printable import counted
from bifa.screen import Console, passing_bars, words

EXAMPLES = (
    "bifa fit out/bench --out model.toml",
    "bifa fit out/bench --out model.toml --report fit.html --pictures out/pictures",
)


def fit(
    dataset: Annotated[Path, DATASET],
    out: Annotated[Path, typer.Option(help="Model file to write.")],
    model: Annotated[Path | None, BASE_MODEL] = None,
    report: Annotated[Path | None, REPORT] = None,
    pictures: Annotated[Path | None, PICTURES] = None,
) -> None:
    """Identify the model (the paper's section IV), first from static loadings, rests and sensors separately, then
    jointly from everything. Reports each parameter with its 90 % interval, what the data do not determine, and the
    error in units of the noise, and writes a model file for `bifa simulate` and `bifa optimize`. The pictures show
    every condition as measured and as modelled, like the paper's Figs. 4 to 6.
    """
    check_targets(out, report, folders=(pictures,), inputs=(model,))

    console = Console()
    with console.status("reading"):
        from bifa.data import read_dataset
        from bifa.identify.identification import identify
        from bifa.report.fit import draw_curves, errors_table, fit_page, parameters_and_remarks
        from bifa.report.terminal import print_sections, print_table
        from bifa.robot import load_model, save_model

        measured = read_dataset(dataset)
        warn_of_findings(console, measured)
    begun = time.perf_counter()
    with passing_bars(console, SpinnerColumn(), words("{task.description}"), TimeElapsedColumn()) as progress:
        task = progress.add_task("reading")
        found = identify(
            measured,
            load_model(model) if model else None,
            date=date.today().isoformat(),
            on_progress=lambda stage: progress.update(task, description=stage),
        )
    save_model(out, found.model)  # what was asked for is written first: output that nobody reads must not lose it
    if report is not None:
        from bifa.report.page import write_page

        write_page(fit_page(found), report)
    if pictures is not None:
        with written_into(pictures) as aside:
            draw_curves(found, aside)
    print_sections(console, parameters_and_remarks(found))
    print_table(console, errors_table(found))
    if report is not None:
        console.print(f"report: {report}")
    if pictures is not None:
        console.print(f"pictures: {pictures}")
    quoted = shlex.quote(str(out))
    console.print(
        f"{out}: fitted to {counted(len(measured.trials), 'trial')} in {time.perf_counter() - begun:.1f} s. "
        f"Next: bifa simulate --model {quoted} --gait GAIT.toml, or bifa optimize --model {quoted} --out gait.toml",
        soft_wrap=True,
    )
