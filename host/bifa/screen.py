"""The console that commands print to. Text is always shown literally, wherever it comes from."""

import math
from collections.abc import Iterable
from typing import Any

import rich.console
from rich.progress import Progress, ProgressColumn, TextColumn
from rich.segment import Segment
from rich.status import Status
from rich.text import Text

from bifa.printable import printable


class Console(rich.console.Console):
    """Rich's console, but plain strings are never interpreted: no escape sequences, markup or emoji codes. Colored text
    is passed as a `Text`."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"markup": False, "emoji": False, "highlight": False} | options)

    def render(self, *args: Any, **kwargs: Any) -> Iterable[Segment]:
        """See rich.console.Console. Text is made printable; rich's own control codes are kept."""
        for segment in super().render(*args, **kwargs):
            yield segment if segment.control else Segment(printable(segment.text), segment.style)

    def status(self, status: Any, **options: Any) -> Status:
        """See rich.console.Console, whose own status would interpret markup."""
        return super().status(Text(status) if isinstance(status, str) else status, **options)


class Countdown:
    """Shows what is being waited for and how long it still takes, in one line that is redrawn in place, or printed once
    if that is not possible. Input typed meanwhile may follow the line."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._status: Status | None = None
        self._what = ""

    def show(self, what: str, left_s: float) -> None:
        """Show that `what` takes `left_s` more."""
        text = f"{what}: {math.ceil(left_s)} s"
        if self._status is not None:
            self._status.update(Text(text))
        elif self._console.is_terminal:
            self._status = self._console.status(text)
            self._status.start()
        elif what != self._what:
            self._console.print(text)
        self._what = what

    def close(self) -> None:
        """Remove the line; a second call does nothing."""
        if self._status is not None:
            self._status.stop()
        self._status, self._what = None, ""


def passing_bars(console: Console, *columns: ProgressColumn) -> Progress:
    """Return a progress display that vanishes at its end, and prints nothing to a file or a pipe, which may have no
    reader any more."""
    return Progress(*columns, console=console, transient=True, disable=not console.is_interactive)


def words(template: str, **options: Any) -> TextColumn:
    """Return a text column for a progress bar that does not interpret markup."""
    return TextColumn(template, markup=False, **options)


def warning(text: str) -> Text:
    """Return a warning in the format used by all commands."""
    return Text.assemble(("warning", "yellow"), " ", text)
