"""`bifa flash`: build the firmware, write it to the Uno, and check that it answers."""

from typing import Annotated

import typer

from bifa.cli._options import port_option
from bifa.computer import EXAMPLE_PORT

EXAMPLES = f"Examples:  bifa flash   |   bifa flash --port {EXAMPLE_PORT}   |   bifa flash --build-only"


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog=EXAMPLES)(flash)


def flash(
    port: Annotated[str | None, port_option("The Uno's serial port; detected if left out.")] = None,
    build_only: Annotated[bool, typer.Option("--build-only", help="Build the image, write nothing.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Show PlatformIO's whole output.")] = False,
) -> None:
    """Build the firmware with PlatformIO, write it to the Uno, and check that it answers.

    Vent the supplies first: while the bootloader runs, the valve pins float, and only the gates' pull-downs
    keep the valves off.
    """
    from bifa.link import Uno
    from bifa.rig import open_rig
    from bifa.screen import Console
    from bifa.toolchain import build_image, choose_port, project_folder, upload_image

    console = Console()
    show = console.out if verbose else _ignore
    project = project_folder()
    chosen = None if build_only else choose_port(port)
    with console.status("building"):
        image = build_image(project, show)
    console.print(f"built {image.relative_to(project)}", highlight=False)
    if chosen is None:
        return
    with console.status(f"writing to {chosen}"):
        try:
            upload_image(project, chosen, show)
        except KeyboardInterrupt:
            console.print("[red]interrupted:[/red] the Uno may hold half an image; run `bifa flash` again")
            raise
    with console.status("waiting for the firmware"), open_rig(chosen) as rig, Uno(rig.transport, rig.clock) as uno:
        hello = uno.connect()
    console.print(f"firmware {hello.firmware} answers on {chosen}", highlight=False)


def _ignore(_: str) -> None:
    """PlatformIO's output is shown only when it fails."""
