"""`bifa monitor`: pressures, valves and phases, live."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from bifa.cli._options import PORT, file_option, requires
from bifa.screen import Console, warning

_WEB_PORT = 8765

EXAMPLES = (
    "bifa monitor",
    "bifa monitor --run",
    "bifa monitor --port virtual --run --seconds 20",
    "bifa monitor --web --model out/demo/model-completed.toml",
)


def monitor(
    port: Annotated[str | None, PORT] = None,
    gait: Annotated[Path | None, file_option("Upload this gait first.")] = None,
    run: Annotated[bool, typer.Option("--run", help="Start walking.")] = False,
    web: Annotated[
        bool, typer.Option("--web", help="Serve a page for the browser, with sliders for the gait.")
    ] = False,
    web_port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help=f"Port of the page (default: {_WEB_PORT}); 0 takes any free one."),
    ] = None,
    model: Annotated[Path | None, file_option("Model for the page's predictions (default: nominal).")] = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.1, help="Stop after this many seconds (default: until Ctrl-C).")
    ] = None,
) -> None:
    """Watch the robot: pressures over the last seconds, valves, phases, and samples lost on the link.

    With --web, a page is served to this computer only, at the printed address; anyone who has the address can change
    the gait, walk and stop. The page has a stop button, which shows when the Uno has confirmed the stop.

    Opening the port restarts the Uno. When the command ends, also by Ctrl-C, all valves are off.
    """
    if not web:
        requires("--web", model=model, web_port=web_port)

    from bifa.rig import check_port

    check_port(port)

    from bifa.link import Uno
    from bifa.link.leaving import valves_at
    from bifa.live.monitor import watch
    from bifa.live.walk import UNSUPPLIED
    from bifa.rig import SameBoard, open_rig
    from bifa.robot import load_model, nominal
    from bifa.robot.gait import read_gait_file

    console = Console()
    parameters = read_gait_file(gait).parameters if gait else {}
    robot = load_model(model) if model else nominal()

    def begin(uno: Uno, is_back: bool = False) -> None:
        if parameters:
            uno.upload(parameters)
        if run and not is_back:
            if uno.get("pressure_psi") == 0.0:
                console.print(warning(UNSUPPLIED))
            uno.run()

    try:
        if not web:
            with open_rig(port) as rig:
                watch(Uno(rig.transport, rig.clock), rig.clock, console, seconds, begin)
            return
        with console.status("starting the page"):
            from bifa.live.web.pilot import Pilot, fly
            from bifa.live.web.server import LivePage, served
            from bifa.report.page import live_page

            pilot = Pilot()
            page = LivePage(pilot, live_page(), robot)
        pilot.is_watched = page.is_watched
        say = partial(console.print, soft_wrap=True)
        with served(page, _WEB_PORT if web_port is None else web_port) as address:
            say(f"page: {address.url}   (Ctrl-C closes it and stops the robot)")
            fly(pilot, SameBoard(port), page.tell, say, seconds, begin)
    except KeyboardInterrupt as interrupt:
        typer.echo(valves_at(interrupt))
