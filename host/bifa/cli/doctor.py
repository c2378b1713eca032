"""`bifa doctor`: report what is installed, which port and firmware are found, and how to get what is missing."""

from typing import Annotated

import typer
from rich.text import Text

from bifa.cli._options import port_option
from bifa.computer import EXAMPLE_PORT
from bifa.screen import Console

EXAMPLES = ("bifa doctor", f"bifa doctor --port {EXAMPLE_PORT}", "bifa doctor --port virtual")


def doctor(port: Annotated[str | None, port_option("Also query the board at this port (it restarts).")] = None) -> None:
    """Report what is installed, which port and firmware are found, what is missing and how to get it.

    Exits with status 1 if something required is missing.
    """
    from bifa.toolchain.checks import MISSING, run_checks

    colors = {"ok": "green", "missing": "red", "optional": "yellow"}
    console = Console()
    missing = False
    with console.status("checking"):
        for finding in run_checks(port):
            missing |= finding.state == MISSING
            said = Text.assemble((f"{finding.state:9}", colors[finding.state]), f" {finding.what:22} {finding.found}")
            console.print(said, soft_wrap=True)
            if finding.remedy:
                console.out(f"{'':10}fix: {finding.remedy}")
    if missing:
        raise typer.Exit(1)
