"""Options shared by several commands, each under one name and with completion; and how commands end."""

import pkgutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import typer

from bifa.printable import counted

Profile = Literal["ideal", "realistic", "worn"]
Method = Literal["cma", "de", "bo"]  # bifa.gait.methods.METHODS, which would be seconds to import
Obstacle = Literal["tunnel", "subtunnels", "arcs"]  # bifa.simulate.obstacles


def ports(incomplete: str = "") -> list[str]:
    """Rigs by name and serial ports, for completion."""
    from importlib.metadata import entry_points

    from bifa.rig.ports import serial_ports

    names = [*entry_points(group="bifa.rigs").names, *(port.device for port in serial_ports())]
    return [name for name in names if name.startswith(incomplete)]


def effects(incomplete: str = "") -> list[str]:
    """Effects of the library, one a file, for completion."""
    import bifa.effects

    names = sorted(module.name for module in pkgutil.iter_modules(bifa.effects.__path__) if module.name != "effect")
    return [name for name in names if name.startswith(incomplete)]


def known_names(incomplete: str = "") -> list[str]:
    """Parameters that can be declared, as NAME=, for completion."""
    from bifa.robot.parameters import BASE_PARAMETERS

    return [f"{name}=" for name in BASE_PARAMETERS if name.startswith(incomplete)]


def gait_names(incomplete: str = "") -> list[str]:
    """Gaits of the library, for completion."""
    from bifa.gait.library import NAMES

    return [name for name in NAMES if name.startswith(incomplete)]


def stages(incomplete: str = "") -> list[str]:
    """Stages of a campaign, for completion."""
    from bifa.campaign.loop import campaign
    from bifa.campaign.setup import Effort, Setup

    names = [stage.name for stage in campaign(Setup("virtual"), Effort(), lambda what, share: None)]
    return [name for name in names if name.startswith(incomplete)]


def port_option(text: str = "Serial port, `virtual`, or the name of a rig; detected if left out.") -> Any:
    """The option --port."""
    return typer.Option(help=text, metavar="PORT", autocompletion=ports)


def file_option(text: str) -> Any:
    """An option for an input file, which must exist."""
    return typer.Option(help=text, exists=True, dir_okay=False)


DATASET = typer.Argument(help="The data set's folder.", show_default=False, exists=True, file_okay=False)
PORT = port_option()
KNOWN = typer.Option(
    help="A value that you measured, such as head_mass_kg=0.182; repeatable.",
    metavar="NAME=VALUE",
    autocompletion=known_names,
)
RERUN = typer.Option(help="Run this stage again even if it is up to date.", metavar="STAGE", autocompletion=stages)
WATCH = typer.Option(help="Folder in which your instruments save, subfolders included (serial port).")
BENCH = typer.Option(help="File that declares how your instruments write theirs (bifa instrument).")
PROFILE = typer.Option(help="Profile of a virtual robot; ideal: the paper's equations and white noise.")
PICTURES = typer.Option("--pictures", help="Folder for the pictures.")
NO_PICTURES = typer.Option("--no-pictures", help="Draw nothing.")


def kept(out: Path, what: str) -> str:
    """What an interrupted recording has on disk, in words; `what`: one of its files."""
    from bifa.data.write import partial_of

    partial = partial_of(out)
    return f"{partial} keeps {counted(len(list(partial.glob('*.csv'))), what)}"


@contextmanager
def stoppable(kept: Callable[[], str]) -> Iterator[None]:
    """On Ctrl-C, end the command with status 130 and a line with what `kept()` says was kept."""
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(f"\nstopped; {kept()}")
        raise typer.Exit(130) from None
