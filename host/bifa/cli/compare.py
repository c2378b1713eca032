"""`bifa compare`: several campaigns side by side."""

from pathlib import Path
from typing import Annotated

import typer

from bifa.cli._options import REPORT
from bifa.files import check_targets
from bifa.screen import Console

EXAMPLES = ("bifa compare out/monday out/tuesday", "bifa compare out/* --report compare.html")


def compare(
    runs: Annotated[list[Path], typer.Argument(help="Two or more folders of finished campaigns.", show_default=False)],
    report: Annotated[Path | None, REPORT] = None,
) -> None:
    """Compare the models, verdicts and gaits of several campaigns."""
    if len(runs) < 2:
        raise typer.BadParameter("compare takes two campaigns or more: bifa compare out/monday out/tuesday")

    check_targets(report, inputs=tuple(file for run in runs for file in run.glob("*")))

    console = Console()
    with console.status("reading"):
        from bifa.campaign import side_by_side
        from bifa.report.terminal import print_table

        found = side_by_side.read_runs(runs)
    if report is not None:  # before anything is printed: output that nobody reads must not lose it
        from bifa.report.page import write_page

        write_page(side_by_side.compare_page(found), report)
    print_table(console, side_by_side.verdict_table(found))
    print_table(console, side_by_side.speed_table(found))
    print_table(console, side_by_side.error_table(found))
    print_table(console, side_by_side.parameter_table(found))
    for which in found[0].gaits:
        print_table(console, side_by_side.gait_table(found, which))
    if report is not None:
        console.print(f"report: {report}", soft_wrap=True)
