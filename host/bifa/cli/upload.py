"""`bifa upload`: send a gait file to the Uno, as a whole or not at all."""

from pathlib import Path
from typing import Annotated

import typer

from bifa.cli._options import PORT, requires
from bifa.computer import EXAMPLE_PORT
from bifa.screen import Console, warning

EXAMPLES = (
    "bifa upload gait.toml",
    "bifa upload gait.toml --save fast --run",
    f"bifa upload gait.toml --run --seconds 60 --port {EXAMPLE_PORT}",
)


def upload(
    gait: Annotated[
        Path,
        typer.Argument(
            help="TOML file with period_s, psi12_deg, psi13_deg and the three duties.", exists=True, dir_okay=False
        ),
    ],
    port: Annotated[str | None, PORT] = None,
    save: Annotated[str | None, typer.Option(help="Also save it on the Uno as a preset of this name.")] = None,
    run: Annotated[bool, typer.Option("--run", help="Then walk until Ctrl-C.")] = False,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="With --run: stop after this many seconds.")] = None,
) -> None:
    """Send a gait to the Uno and read it back; parameters that the file does not name keep their values.

    Opening the port restarts the Uno: it stops walking and loads its start preset. When --run ends, all valves are
    off.
    """
    if not run:
        requires("--run", seconds=seconds)

    from bifa.rig import check_port

    check_port(port)

    from bifa.link import Uno
    from bifa.link.leaving import raise_if_unconfirmed, valves
    from bifa.live.walk import UNSUPPLIED, walk
    from bifa.rig import open_rig
    from bifa.robot.gait import read_gait_file

    parameters = read_gait_file(gait).parameters
    console = Console()
    with open_rig(port) as rig:
        try:
            with console.status("waiting for the Uno") as shown, Uno(rig.transport, rig.clock) as uno:
                hello = uno.connect()
                uploaded = uno.upload(parameters, save=save)
                done = ", ".join(["read back equal", *(["saved as " + save] if save else [])])
                console.print(f"{gait.name} is on the Uno (firmware {hello.firmware}): {done}")
                if run:
                    if uploaded["pressure_psi"] == 0.0:
                        console.print(warning(UNSUPPLIED))
                    console.print("walking; Ctrl-C ends" if seconds is None else f"walking for {seconds:g} s")
                    walk(uno, rig.clock, seconds, shown.update)
        except KeyboardInterrupt as interrupt:
            if not run:
                raise
            raise_if_unconfirmed(interrupt)
        if run:
            console.print(valves())
