"""`bifa rig`: serve the virtual bench on a pseudo-terminal in real time, for any serial program."""

import math
import os
import signal
from pathlib import Path
from typing import Annotated, Any

import typer

from bifa.cli._options import PROFILE, Profile, effects
from bifa.errors import BifaError
from bifa.files import check_targets
from bifa.screen import Console

EXAMPLES = (
    "bifa rig",
    "bifa rig --link /tmp/uno",
    "bifa console --port /tmp/uno (in another terminal; or picocom -b 250000 /tmp/uno)",
    "bifa rig --profile realistic --effect hysteresis:force_N=4 --effect leak:rate_per_s=0.05",
)


def rig(
    profile: Annotated[Profile, PROFILE] = "ideal",
    effect: Annotated[
        list[str] | None,
        typer.Option(help="Effect: NAME or NAME:PARAMETER=VALUE,...; repeatable.", autocompletion=effects),
    ] = None,
    sealed: Annotated[
        int | None, typer.Option(min=0, help="Draw a robot with an undisclosed effect, from this seed.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of noise, clocks and run-to-run variation.")] = 0,
    firmware: Annotated[Path | None, typer.Option(help="Firmware image, ELF or HEX (default: the built one).")] = None,
    eeprom: Annotated[
        Path | None, typer.Option(help="File that keeps the EEPROM between runs.", dir_okay=False)
    ] = None,
    link: Annotated[Path | None, typer.Option(help="Symbolic link to create to the pty while it is served.")] = None,
) -> None:
    """Serve the virtual robot, running the real firmware, as a serial port in real time.

    Opening the port resets the board, as with a real Uno. Any serial program can connect, at 250000 baud.
    """
    from bifa.rig import open_rig

    if not hasattr(os, "openpty"):
        raise BifaError("bifa rig serves a pseudo-terminal, which needs Linux or macOS (on Windows: WSL)")
    for ending in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(ending, signal.default_int_handler)  # a closed terminal ends as cleanly as Ctrl-C
    check_targets(eeprom)
    console = Console()
    effects = dict(_effect(text) for text in effect or [])
    options = {"profile": profile, "effects": effects, "sealed": sealed, "seed": seed}
    with console.status("starting"):
        virtual: Any = open_rig("virtual", **options, firmware=firmware, eeprom=eeprom, keep_events=False)
    with virtual as bench, console.status("starting", spinner="dots") as status:

        def ready(path: str) -> None:
            console.print(f"{link or path}  250000 baud; Ctrl-C ends", soft_wrap=True)

        try:
            bench.serve_pty(ready, lambda now: status.update(_line(now)), link=link)
        except KeyboardInterrupt:
            console.print("stopped")


def _effect(text: str) -> tuple[str, dict[str, float]]:
    name, _, rest = text.partition(":")
    try:
        values = {key: float(value) for key, value in (part.split("=") for part in rest.split(",") if part)}
    except ValueError:
        raise BifaError(f"--effect {text}: write NAME or NAME:PARAMETER=VALUE,PARAMETER=VALUE") from None
    if not all(map(math.isfinite, values.values())):
        raise BifaError(f"--effect {text}: a value is not a finite number")
    return name, values


def _line(now: dict[str, Any]) -> str:
    chambers = " ".join(f"{psi:+.1f}" for psi in now["pressure_psi"])
    port = "open" if now["open"] else "closed"
    place = f"{now['displacement_mm']:.1f} mm"
    return f"{now['time_s']:.1f} s  port {port}  {place}  {chambers} psi  asleep {now['asleep']:.0%}"
