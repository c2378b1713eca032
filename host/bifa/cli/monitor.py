"""`bifa monitor`: pressures, valves and phases, live."""

from pathlib import Path
from typing import Annotated

import typer

from bifa.cli._options import PORT, file_option

EPILOG = """Examples:  bifa monitor   |   bifa monitor --run   |   bifa monitor --port virtual --run --seconds 20"""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog=EPILOG)(monitor)


def monitor(
    port: Annotated[str | None, PORT] = None,
    gait: Annotated[Path | None, file_option("Upload this gait first.")] = None,
    run: Annotated[bool, typer.Option("--run", help="Start walking.")] = False,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="End after so long; otherwise Ctrl-C.")] = None,
) -> None:
    """Watch the robot: pressures with their last seconds, valves, phases, and what the link has lost.

    Opening the port restarts an Uno. At the end, Ctrl-C included, all valves are off.
    """
    from bifa.rig import check_port

    check_port(port)

    from bifa.link import Uno
    from bifa.live.monitor import watch
    from bifa.rig import open_rig
    from bifa.robot.gait import read_gait_file
    from bifa.screen import Console

    parameters = read_gait_file(gait).parameters if gait else {}

    def begin(uno: Uno) -> None:
        if parameters:
            uno.upload(parameters)
        if run:
            uno.run()

    with open_rig(port) as rig:
        try:
            watch(Uno(rig.transport, rig.clock), rig.clock, Console(), seconds, begin)
        except KeyboardInterrupt:
            typer.echo("valves off")
