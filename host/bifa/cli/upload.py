"""`bifa upload`: a gait file onto the Uno, as a whole or not at all."""

from pathlib import Path
from typing import Annotated

import typer

EPILOG = """Examples:  bifa upload gait.toml   |   bifa upload gait.toml --save fast --run   |
bifa upload gait.toml --port /dev/ttyACM0"""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog=EPILOG)(upload)


def upload(
    gait: Annotated[Path, typer.Argument(help="TOML file with period_s, psi12_deg, psi13_deg and the three duties.")],
    port: Annotated[str | None, typer.Option(help="Serial port, `virtual`, or nothing: found by itself.")] = None,
    save: Annotated[str | None, typer.Option(help="Keep it on the Uno as a preset of this name.")] = None,
    run: Annotated[bool, typer.Option("--run", help="Start walking; the Uno goes on when this command ends.")] = False,
) -> None:
    """Send a gait to the Uno and read it back; the parameters that the file does not name stay as they are.

    Opening the port restarts an Uno: it stops walking, and comes back with its start preset.
    """
    from rich.console import Console

    from bifa.link import Uno
    from bifa.link.gait_file import read_gait_file
    from bifa.live.ending import end_like_ctrl_c
    from bifa.rig import open_rig

    parameters = read_gait_file(gait)
    console = Console()
    end_like_ctrl_c()
    with open_rig(port) as rig:
        uno = Uno(rig.transport, rig.clock)
        try:
            with console.status("waiting for the Uno"):
                hello = uno.connect()
            uno.upload(parameters, save=save)
            if run:
                uno.run()
        except BaseException:
            uno.make_safe()
            raise
        done = ", ".join(["read back equal", *(["saved as " + save] if save else []), *(["walking"] if run else [])])
        console.print(f"{gait.name} is on the Uno (firmware {hello.firmware}): {done}")
