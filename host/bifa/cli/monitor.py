"""`bifa monitor`: pressures, valves and phases, live."""

from pathlib import Path
from typing import Annotated

import typer

from bifa.cli._options import PORT, file_option

EPILOG = """Examples:  bifa monitor   |   bifa monitor --run   |   bifa monitor --port virtual --run --seconds 20   |
bifa monitor --web --model out/demo/model-completed.toml"""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog=EPILOG)(monitor)


def monitor(
    port: Annotated[str | None, PORT] = None,
    gait: Annotated[Path | None, file_option("Upload this gait first.")] = None,
    run: Annotated[bool, typer.Option("--run", help="Start walking.")] = False,
    web: Annotated[bool, typer.Option("--web", help="On a page in the browser, with sliders for the gait.")] = False,
    web_port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page; 0: any free one.")] = 8765,
    model: Annotated[
        Path | None, typer.Option(help="Model for the page's predictions; the nominal one if left out.")
    ] = None,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="End after this time; otherwise Ctrl-C.")] = None,
) -> None:
    """Watch the robot: pressures over the last seconds, valves, phases, and samples lost on the link.

    With --web the page is served on this computer only, at the printed address; whoever has it can change the gait,
    walk and stop. There is a stop button, which shows when the Uno has confirmed.

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
            if web:
                _fly(rig, Console(), web_port, model, seconds, begin)
            else:
                watch(Uno(rig.transport, rig.clock), rig.clock, Console(), seconds, begin)
        except KeyboardInterrupt:
            typer.echo("valves off")


def _fly(rig, console, port: int, model: Path | None, seconds: float | None, begin) -> None:
    """Serve the page and fly until Ctrl-C or for `seconds`."""
    from bifa.link import Uno
    from bifa.live.web.pilot import Pilot
    from bifa.live.web.server import LivePage, served
    from bifa.report.live_page import live_page
    from bifa.robot import load_model, nominal

    robot = load_model(model) if model else nominal()
    pilot = Pilot(Uno(rig.transport, rig.clock), rig.clock, getattr(rig.instruments, "position_mm", None))
    page = LivePage(pilot, live_page(), robot)
    with served(page, port) as address:
        console.print(f"page: {address.url}   (Ctrl-C ends it, and the robot stops)", highlight=False, soft_wrap=True)
        pilot.fly(page.tell, seconds, begin)
