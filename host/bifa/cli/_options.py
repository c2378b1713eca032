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


# What is completed; typer itself keeps of it what begins as the word does.


def ports() -> list[str]:
    """Rigs by name and serial ports."""
    from importlib.metadata import entry_points

    from bifa.rig.ports import serial_ports

    return [*entry_points(group="bifa.rigs").names, *(port.device for port in serial_ports())]


def effects() -> list[str]:
    """Effects of the library, one a file."""
    import bifa.effects

    return sorted(module.name for module in pkgutil.iter_modules(bifa.effects.__path__) if module.name != "effect")


def known_names() -> list[str]:
    """Parameters that can be declared, as NAME=."""
    from bifa.robot.parameters import BASE_PARAMETERS

    return [f"{name}=" for name in BASE_PARAMETERS]


def gait_names() -> list[str]:
    """Gaits of the library."""
    from bifa.gait.library import NAMES

    return list(NAMES)


def stages() -> list[str]:
    """Stages of a campaign."""
    from bifa.campaign.loop import campaign
    from bifa.campaign.setup import Effort, Setup

    return [stage.name for stage in campaign(Setup("virtual"), Effort(), lambda what, share: None)]


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
BENCH_FILE = Path("bench.toml")
BENCH = file_option(f"File that declares how your instruments write theirs (bifa instrument); else {BENCH_FILE}.")
QUICK = typer.Option("--quick", help="Quick run: two repeats of each condition instead of three.")
PROFILE = typer.Option(help="Profile of a virtual robot; ideal: the paper's equations and white noise.")
PICTURES = typer.Option("--pictures", help="Folder for the pictures.")


def requires(needed: str, **options: object) -> None:
    """Usage error where one of `options` is given, neither None nor False: it does nothing without what is `needed`."""
    given = [name for name, value in options.items() if value is not None and value is not False]
    if idle := [f"--{name.replace('_', '-')}" for name in given]:
        raise typer.BadParameter(f"{' and '.join(idle)} {'require' if idle[1:] else 'requires'} {needed}")


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
