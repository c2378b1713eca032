"""`bifa check`: list what is in a data set, plot it, and warn of what looks wrong."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bifa.cli._options import DATASET, PICTURES
from bifa.files import check_targets, written_into
from bifa.printable import counted
from bifa.screen import Console, warning

if TYPE_CHECKING:
    from bifa.check import Finding
    from bifa.data import Dataset


EXAMPLES = ("bifa check bench-2026-11-21", "bifa check bench-2026-11-21 --pictures out/pictures")


def check(
    dataset: Annotated[Path, DATASET],
    pictures: Annotated[Path | None, PICTURES] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with status 1 if anything is found.")] = False,
) -> None:
    """List what is in a data set, warn of what looks wrong, and plot it with --pictures.

    A malformed data set ends the command with status 2 and an error that names file, line and column. Data that are
    well-formed but doubtful (a clipped sensor, a clock that jumps, missing repeats) and likely mistakes (a reversed
    sign, swapped tubes, the gait of another walk, a mass in grams) are listed as warnings, with status 0.
    """
    check_targets(folders=(pictures,))

    from bifa.check import check_dataset
    from bifa.data import read_dataset

    console = Console()
    with console.status("reading"):
        content = read_dataset(dataset)
        findings = check_dataset(content)
    if pictures is not None:  # before anything is printed: output that nobody reads must not lose them
        from bifa.report.datasets import plot_dataset

        with console.status("drawing"), written_into(pictures) as aside:
            written = plot_dataset(content, aside)
    _print_contents(console, content)
    _print_findings(console, findings)
    if not findings:
        console.print("Nothing looks wrong.")
    if pictures is not None:
        console.print(f"{counted(len(written), 'picture')} in {pictures}")
    if strict and findings:
        raise typer.Exit(1)


def warn_of_findings(console: Console, dataset: "Dataset") -> None:
    """Warn of likely mistakes, which would upset a fit or be mistaken for an effect."""
    from bifa.check.plausibility import check_plausibility

    _print_findings(console, check_plausibility(dataset))


def _print_findings(console: Console, findings: "Sequence[Finding]") -> None:
    from bifa.check.finding import merge_findings

    for kind, text, places in merge_findings(findings):
        console.print(warning(f"[{kind}] {text}"))
        if places:
            console.print(f"  {'; '.join(places)}")


def _print_contents(console: Console, dataset: "Dataset") -> None:
    from bifa.data.dataset import conditions_of
    from bifa.report.page import PageTable
    from bifa.report.terminal import print_lines, print_table
    from bifa.report.words import parameter_words, quantity
    from bifa.robot import nominal

    rows, called = [], conditions_of(dataset)
    for group in dataset.repeats():
        samples = [len(trial.time_s) for trial in group]
        rates = [trial.rate_hz for trial in group]
        seconds = sum(float(trial.time_s[-1] - trial.time_s[0]) for trial in group)
        repeats = ", ".join(str(trial.repeat) for trial in group)
        rows.append(
            [called[group[0].file], repeats, f"{sum(samples)}", f"{sum(rates) / len(rates):.1f}", f"{seconds:.1f}"]
        )
    columns = ["experiment and settings", "repeats", "samples", "rate, Hz", "duration, s"]
    print_table(console, PageTable(columns, rows, f"{dataset.name}: {counted(len(dataset.trials), 'trial')}"))
    units = {name: parameter.unit for name, parameter in nominal().parameters.items()}
    known = [f"{parameter_words(name)} {quantity(v, units.get(name, ''), 3)}" for name, v in dataset.known.items()]
    print_lines(console, [f"known beforehand: {', '.join(known) or 'nothing'}"])
