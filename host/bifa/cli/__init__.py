"""The command `bifa`: one command a file; each file offers `register(app)`.

Heavy imports (numba, matplotlib, SciPy) belong inside the command's function, so that `bifa --help` is instant.
"""

import importlib
import pkgutil
import sys

import typer

from bifa.errors import BifaError
from bifa.printable import printable

app = typer.Typer(
    name="bifa",
    help="Drive a soft in-pipe robot from an Arduino Uno and learn from data how it really behaves.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)


@app.callback()
def _commands() -> None:
    """Drive a soft in-pipe robot from an Arduino Uno and learn from data how it really behaves."""


for _module in sorted(module.name for module in pkgutil.iter_modules(__path__)):
    importlib.import_module(f"{__name__}.{_module}").register(app)


def main() -> None:
    """Run the command; an expected error ends in one clear sentence and exit status 2."""
    try:
        app()
    except Exception as error:
        # A rig that another package offers cannot know BifaError; it marks its errors.
        if not isinstance(error, BifaError) and not getattr(error, "for_the_user", False):
            raise
        typer.echo(f"error: {printable(str(error))}", err=True)
        sys.exit(2)
