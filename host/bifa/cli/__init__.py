"""The command `bifa`: one file per command, with a function of the file's name and the `EXAMPLES` of its help.

Heavy imports (numba, matplotlib, SciPy) belong inside the command's function, so that `bifa --help` is instant.
"""

import importlib
import inspect
import io
import os
import pkgutil
import re
import shutil
import sys
from itertools import pairwise
from typing import Annotated, Any

import typer
import typer.core

import bifa
from bifa.errors import BifaError
from bifa.files import writable
from bifa.printable import printable


class _Commands(typer.core.TyperGroup):
    """Refuse empty arguments; end every command on Ctrl-C with a line on what was kept, and on a full disk with an
    error that says so."""

    def make_context(self, *args: Any, **kwargs: Any) -> Any:
        with writable():  # --help and --version print while the arguments are parsed
            return super().make_context(*args, **kwargs)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        for before, word in pairwise(["bifa", *args]):
            if not word or re.fullmatch(r"--[\w-]+=", word):  # for a path, it would be the working folder
                raise typer.BadParameter(f"nothing is given after {word or before}: was a variable not set?")
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        try:
            with writable():
                return super().invoke(ctx)
        except BaseException as error:
            # Whatever replaced an unconfirmed stop (a Ctrl-C, output that nobody reads, a full disk) must not hide it.
            if leaving := sys.modules.get("bifa.link.leaving"):  # otherwise no robot was connected
                leaving.raise_if_unconfirmed(error)
            if not isinstance(error, KeyboardInterrupt):
                raise
            typer.echo("\nInterrupted. Finished results are listed above; no partial files remain.", err=True)
            raise typer.Exit(130) from None


_PANELS = 80  # terminal columns; on narrower terminals rich's panels would truncate names
# rich and typer accept a width of 0, and end in a traceback if it is no number.
for _width in ("COLUMNS", "TERMINAL_WIDTH"):
    if os.environ.get(_width, "80") not in map(str, range(40, 1001)):
        del os.environ[_width]

app = typer.Typer(
    name="bifa",
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"]},
    no_args_is_help=True,
    rich_markup_mode="rich" if shutil.get_terminal_size().columns >= _PANELS else None,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"bifa {bifa.__version__}")
        raise typer.Exit


@app.callback()
def _commands(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Drive a soft in-pipe robot from an Arduino Uno and learn from data how it really behaves."""


for _module in sorted(module.name for module in pkgutil.iter_modules(__path__) if module.name[0] != "_"):
    _file = importlib.import_module(f"{__name__}.{_module}")
    app.command(epilog="\n\n".join(("Examples:", *_file.EXAMPLES)))(getattr(_file, _module))
for _command in app.registered_commands:  # paragraphs fill the terminal, wherever the docstring breaks its lines
    _command.help = re.sub(r"(?<!\n)\n(?!\n)", " ", inspect.getdoc(_command.callback) or "")
    # the whole sentence; typer truncates at 45 characters
    _command.short_help = re.split(r"(?<=\.)\s", _command.help)[0]


def main() -> None:
    """Run the command; an expected error prints its message and exits with status 2."""
    _replace_unencodable()
    try:
        app()
    except Exception as error:
        # Rigs from other packages cannot import BifaError; they mark their errors instead.
        if not isinstance(error, BifaError) and not getattr(error, "for_the_user", False):
            raise
        typer.echo(f"error: {printable(str(error))}", err=True)
        sys.exit(2)


def _replace_unencodable() -> None:
    """Replace what cannot be encoded: on Windows, redirected output uses a legacy code page without Greek letters."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # without a console it is None; an embedding program may replace it
            stream.reconfigure(errors="replace")
