"""Options shared by several commands, with their completion, and the handling of Ctrl-C."""

import pkgutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import typer

from bifa.printable import counted

Profile = Literal["ideal", "realistic", "worn"]
Method = Literal["cma", "de", "bo"]  # bifa.gait.methods.METHODS, which takes seconds to import
Obstacle = Literal["tunnel", "subtunnels", "arcs"]  # bifa.simulate.obstacles


# Completions: typer keeps those that begin with what was typed.


def ports() -> list[str]:
    """Names of rigs, and serial ports."""
    from importlib.metadata import entry_points

    from bifa.rig.ports import serial_ports

    return [*entry_points(group="bifa.rigs").names, *(port.device for port in serial_ports())]


def effects() -> list[str]:
    """Names of the library's effects."""
    import bifa.effects

    return sorted(module.name for module in pkgutil.iter_modules(bifa.effects.__path__) if module.name != "effect")


def known_names() -> list[str]:
    """Parameters whose values can be declared, as `NAME=`."""
    from bifa.robot.parameters import BASE_PARAMETERS

    return [f"{name}=" for name in BASE_PARAMETERS]


def gait_names() -> list[str]:
    """Names of the library's gaits."""
    from bifa.gait.library import NAMES

    return list(NAMES)


def stages() -> list[str]:
    """Names of the stages of a virtual and of a real campaign."""
    from bifa.campaign.loop import campaign
    from bifa.campaign.setup import Effort, Setup

    campaigns = (campaign(Setup(port), Effort(), lambda what, share: None) for port in ("virtual", ""))
    return list(dict.fromkeys(stage.name for stages in campaigns for stage in stages))


def port_option(text: str = "Serial port, `virtual`, or the name of a rig (default: detected).") -> Any:
    """The option --port."""
    return typer.Option(help=text, metavar="PORT", autocompletion=ports)


def file_option(text: str) -> Any:
    """An option for an input file, which must exist."""
    return typer.Option(help=text, exists=True, dir_okay=False)


OUT = typer.Option(help="Folder for all artefacts; name it again to resume.")
DATASET = typer.Argument(help="The data set's folder.", show_default=False, exists=True, file_okay=False)
PORT = port_option()
KNOWN = typer.Option(
    help="Value of a parameter that you measured, such as head_mass_kg=0.182; repeatable.",
    metavar="NAME=VALUE",
    autocompletion=known_names,
)
RERUN = typer.Option(help="Run this stage again even if it is up to date.", metavar="STAGE", autocompletion=stages)
WATCH = typer.Option(help="Folder, including subfolders, where your instruments save their files (serial port).")
BENCH_FILE = Path("bench.toml")
BENCH = file_option(f"File that declares the formats of your instruments (bifa instrument; default: {BENCH_FILE}).")
QUICK = typer.Option("--quick", help="Quick run: two repeats of each condition instead of three.")
PROFILE = typer.Option(help="Profile of the virtual robot; ideal: the paper's equations with white noise.")
PICTURES = typer.Option("--pictures", help="Folder for the pictures.")
REPORT = typer.Option(help="Write a self-contained HTML report.")
BASE_MODEL = file_option("Base model to start from (default: the nominal one).")


def requires(needed: str, **options: object) -> None:
    """Raise a usage error if any of `options` is given (not None or False): they have no effect without `needed`."""
    given = [name for name, value in options.items() if value is not None and value is not False]
    if idle := [f"--{name.replace('_', '-')}" for name in given]:
        raise typer.BadParameter(f"{' and '.join(idle)} {'require' if idle[1:] else 'requires'} {needed}")


def kept(out: Path, what: str) -> str:
    """Describe what an interrupted recording has left on disk, and how to resume it; `what` names one of its files."""
    from bifa.data.write import partial_of

    partial = partial_of(out)
    if not partial.exists():
        return "nothing has been recorded yet"
    return f"{partial} keeps {counted(len(list(partial.glob('*.csv'))), what)}; run the same command to resume"


@contextmanager
def stoppable(kept: Callable[[], str], moves: bool = True) -> Iterator[None]:
    """On Ctrl-C, print what is known of the valves, if the command moves a robot, and what was kept, as described by
    `kept()`; exit with status 130."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        from bifa.link.leaving import valves_at

        valves = f"{valves_at(interrupt)}; " if moves else ""
        typer.echo(f"\nstopped; {valves}{kept()}")
        raise typer.Exit(130) from None
