"""`bifa monitor`: pressures, valves and phases, live."""

from pathlib import Path
from typing import Annotated

import typer

EPILOG = """Examples:  bifa monitor   |   bifa monitor --run   |   bifa monitor --port virtual --run --seconds 20"""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog=EPILOG)(monitor)


def monitor(
    port: Annotated[str | None, typer.Option(help="Serial port, `virtual`, or nothing: found by itself.")] = None,
    gait: Annotated[Path | None, typer.Option(help="Upload this gait first.")] = None,
    run: Annotated[bool, typer.Option("--run", help="Start walking.")] = False,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="End after so long; otherwise Ctrl-C.")] = None,
) -> None:
    """Watch the robot: pressures with their last seconds, valves, phases, and what the link has lost.

    Opening the port restarts an Uno. At the end, Ctrl-C included, all valves are off.
    """
    from rich.console import Console

    from bifa.link import Uno
    from bifa.link.gait_file import read_gait_file
    from bifa.live.ending import end_like_ctrl_c
    from bifa.live.monitor import watch
    from bifa.rig import open_rig

    parameters = read_gait_file(gait) if gait else {}
    console = Console()
    end_like_ctrl_c()
    with open_rig(port) as rig, Uno(rig.transport, rig.clock) as uno:
        with console.status("waiting for the Uno"):
            uno.connect()
        if parameters:
            uno.upload(parameters)
        if run:
            uno.run()
        try:
            watch(uno, rig, console, seconds)
        except KeyboardInterrupt:
            typer.echo("valves off")
