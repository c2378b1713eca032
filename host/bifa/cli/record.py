"""`bifa record`: record walks as a data set or, without instruments, the Uno's telemetry."""

from pathlib import Path
from typing import Annotated

import typer

from bifa.cli._options import PORT, file_option, kept, requires, stoppable
from bifa.files import check_targets
from bifa.screen import Console

_CYCLES, _REPEATS = 6, 1

EXAMPLES = (
    "bifa record --out out/walks --port virtual --gait gait.toml --cycles 10",
    "bifa record --out out/telemetry --seconds 60",
)


def record(
    out: Annotated[Path, typer.Option(help="A new folder, or that of an interrupted recording.", show_default=False)],
    port: Annotated[str | None, PORT] = None,
    gait: Annotated[
        Path | None, file_option("Gait to walk (default: the baseline; without instruments, no walk).")
    ] = None,
    cycles: Annotated[
        int | None, typer.Option(min=1, help=f"Cycles per walk (default: {_CYCLES}; only with instruments).")
    ] = None,
    repeats: Annotated[
        int | None, typer.Option(min=1, help=f"Number of walks (default: {_REPEATS}; only with instruments).")
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.1, help="Stop after this many seconds (default: until Ctrl-C; only without instruments)."),
    ] = None,
) -> None:
    """Record walks as a data set or, without instruments, the Uno's telemetry.

    A rig with motion capture yields a data set for `bifa check` and `bifa diagnose`. A bare Uno yields a folder with
    telemetry (pressures, commands, phases, the Uno's and the computer's time), written as it arrives. If the port
    vanishes, the data recorded so far are kept, and recording resumes when the same Uno is back; you are asked before
    it walks again. Run an interrupted command again to resume it.
    """
    from bifa.rig import check_port

    check_targets(folders=(out,))
    check_port(port)

    from bifa.live.record import record_telemetry, record_walks
    from bifa.report.terminal import plain_spaces
    from bifa.report.words import gait_words
    from bifa.rig import SameBoard, open_rig
    from bifa.robot.gait import BASELINE, read_gait_file

    console = Console()
    steps = plain_spaces(gait_words((read_gait_file(gait).gait if gait else BASELINE).as_dict()))
    with open_rig(port) as rig:
        has_instruments = rig.instruments is not None
        if has_instruments:
            requires("a rig without instruments", seconds=seconds)
            console.print(f"gait: {gait or 'the baseline'}, {steps}")
            with stoppable(lambda: kept(out, "finished walk")):
                record_walks(rig, port, out, gait, cycles or _CYCLES, repeats or _REPEATS, console)
    if not has_instruments:
        requires("a rig with instruments", cycles=cycles, repeats=repeats)
        console.print(f"gait: {gait}, {steps}" if gait else "no --gait: recording without walking")
        record_telemetry(SameBoard(port), out, gait, seconds, console)
