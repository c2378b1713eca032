"""`bifa console`: the Uno's text console with history, completion and a status line."""

import queue
import sys
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from bifa.cli._options import PORT
from bifa.computer import EXAMPLE_PORT
from bifa.errors import BifaError
from bifa.screen import Console

if TYPE_CHECKING:
    from bifa.link import Uno
    from bifa.rig import Rig


EXAMPLES = ("bifa console", "bifa console --port virtual", f"echo show | bifa console --port {EXAMPLE_PORT}")

_READ_AHEAD = 1000  # lines of a pipe that wait
_LOOK_S = 0.02  # less than any useful `host_timeout_s`


def console(port: Annotated[str | None, PORT] = None) -> None:
    """Type commands to the Uno; `help` lists them. `!` stops at once; Ctrl-D or Ctrl-C leaves, with all valves off.

    Piped input is sent line by line; the answers are printed, and the exit status is 1 if any was an error.
    """
    if sys.stdin is None:
        raise BifaError("stdin is closed; run it in a terminal, or pipe lines into it")

    from bifa.link import Uno
    from bifa.link.leaving import OFF, valves
    from bifa.link.terminal import settle
    from bifa.rig import open_rig

    typed = sys.stdin.isatty()
    with open_rig(port) as rig:
        with Uno(rig.transport, rig.clock) as uno:
            with Console(stderr=True).status("waiting for the Uno"):
                uno.connect()
                settle(uno, rig.clock)
            if typed:
                from bifa.live.interactive import converse

                converse(uno, rig)
            elif not _pipe(uno, rig):
                raise typer.Exit(1)
        if typed:
            typer.echo("the Uno confirms that all valves are off" if valves() == OFF else valves())


def piped_lines(uno: "Uno") -> Iterator[str]:
    """Yield the pipe's lines, and keep the link to the Uno alive while the pipe is silent."""
    from bifa.measure.desk import read_lines

    come: queue.Queue[str | None] = queue.Queue(_READ_AHEAD)
    threading.Thread(target=read_lines, args=(come,), daemon=True).start()
    while True:
        try:
            line = come.get(timeout=_LOOK_S)
        except queue.Empty:
            uno.keep_alive()
            continue
        if line is None:
            return
        yield line.rstrip("\r")


def _pipe(uno: "Uno", rig: "Rig") -> bool:
    from bifa.link.terminal import raise_if_greeted, reports_stop, type_line

    good, before = True, ""
    uno.session.lines.clear()  # drop the greeting: a pipe's reader expects only answers
    for line in piped_lines(uno):
        lines = type_line(uno, line, rig.clock)
        typer.echo("\n".join(lines))
        raise_if_greeted(lines, line)
        good = good and lines[-1].startswith("ok")
        if reports_stop(lines, line, before):
            typer.echo("error: the robot has stopped by itself; the remaining lines are not carried out", err=True)
            return False
        before = line
    return good
