"""The console that commands print on: text is text, wherever it comes from."""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import rich.console
from rich.segment import Segment
from rich.text import Text

from bifa.printable import printable

if TYPE_CHECKING:
    from rich.progress import TextColumn
    from rich.status import Status


class Console(rich.console.Console):
    """Rich's, which interprets nothing in the text it is given: no escape sequence, no markup, no emoji code.
    Colored text is given as a `Text`."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"markup": False, "emoji": False, "highlight": False} | options)

    def render(self, *args: Any, **kwargs: Any) -> Iterable[Segment]:
        """See rich.console.Console: text is made printable, rich's own control codes stay."""
        for segment in super().render(*args, **kwargs):
            yield segment if segment.control else Segment(printable(segment.text), segment.style)

    def status(self, status: Any, **options: Any) -> "Status":
        """See rich.console.Console, whose status would take markup."""
        return super().status(Text(status) if isinstance(status, str) else status, **options)


class Countdown:
    """What is being waited for, and for how long still: one line, redrawn in place; printed once where it cannot be.
    Input that is typed meanwhile may follow it."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._status: Status | None = None
        self._what = ""

    def show(self, what: str, left_s: float) -> None:
        """`what` goes on for `left_s` more."""
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
        """The line goes; a second call does nothing."""
        if self._status is not None:
            self._status.stop()
        self._status, self._what = None, ""


def words(template: str, **options: Any) -> "TextColumn":
    """A column of a progress bar, in which markup is text."""
    from rich.progress import TextColumn  # most commands show no bar

    return TextColumn(template, markup=False, **options)


def warning(text: str) -> Text:
    """A warning, as every command shows one."""
    return Text.assemble(("warning", "yellow"), " ", text)
