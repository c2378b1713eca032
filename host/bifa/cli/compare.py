"""`bifa compare`: several campaigns side by side."""

from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = ("bifa compare out/monday out/tuesday", "bifa compare out/* --report compare.html")


def compare(
    runs: Annotated[list[Path], typer.Argument(help="Two or more folders of finished campaigns.", show_default=False)],
    report: Annotated[Path | None, typer.Option(help="Write a self-contained HTML report.")] = None,
) -> None:
    """Compare the models, verdicts and gaits of several campaigns."""
    if len(runs) < 2:
        raise typer.BadParameter("compare takes two campaigns or more: bifa compare out/monday out/tuesday")

    from bifa.files import check_targets

    check_targets(report, inputs=tuple(file for run in runs for file in run.glob("*")))

    from bifa.screen import Console

    console = Console()
    with console.status("reading"):
        from bifa.campaign.side_by_side import (
            compare_page,
            error_table,
            gait_table,
            parameter_table,
            read_runs,
            speed_table,
            verdict_table,
        )
        from bifa.report.terminal import print_table

        found = read_runs(runs)
    for table in (verdict_table, speed_table, error_table, parameter_table):
        print_table(console, table(found))
    for which in found[0].gaits:
        print_table(console, gait_table(found, which))
    if report is not None:
        from bifa.report.page import write_page

        write_page(compare_page(found), report)
        console.print(f"report: {report}", soft_wrap=True)
