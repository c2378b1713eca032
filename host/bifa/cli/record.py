"""`bifa record`: walks as a data set, or, without instruments, the Uno's telemetry."""

from pathlib import Path
from typing import Annotated

import typer

EPILOG = """Examples:  bifa record out/walks --port virtual --gait gait.toml --cycles 10 --repeats 3   |
bifa record out/telemetry --seconds 60"""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog=EPILOG)(record)


def record(
    out: Annotated[Path, typer.Argument(help="New folder.")],
    port: Annotated[str | None, typer.Option(help="Serial port, or `virtual`; detected if left out.")] = None,
    gait: Annotated[Path | None, typer.Option(help="Gait to walk; otherwise the baseline.")] = None,
    cycles: Annotated[int, typer.Option(min=1, help="Cycles of each walk (with instruments).")] = 6,
    repeats: Annotated[int, typer.Option(min=1, help="Walks (with instruments).")] = 1,
    seconds: Annotated[float | None, typer.Option(min=0.1, help="Length (without instruments); else Ctrl-C.")] = None,
) -> None:
    """Record walks. On a rig with a motion capture: a data set that `bifa check` and `bifa diagnose` read.

    On a bare Uno: a folder with telemetry (pressures, commands, phases, the Uno's and the computer's time), written as
    it comes. If the port vanishes, what was recorded is kept, and recording resumes when it is back. A command that is
    interrupted is resumed by giving it again.
    """
    from bifa.live.record import record_telemetry, record_walks
    from bifa.rig import open_rig
    from bifa.screen import Console

    console = Console()
    with open_rig(port) as rig:
        has_instruments = rig.instruments is not None
        if has_instruments:
            try:
                record_walks(rig, out, gait, cycles, repeats, console)
            except KeyboardInterrupt:
                console.print(f"valves off; finished walks are kept in {out}; run the same command to resume")
                raise typer.Exit(130) from None
    if not has_instruments:
        record_telemetry(lambda: open_rig(port), out, gait, seconds, console)
