"""The console that commands print on: text is text, wherever it comes from."""

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
    """Rich's, which obeys nothing that stands in what it is given: no escape sequence, no markup, no emoji code. What
    is to be coloured is a `Text`."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**{"markup": False, "emoji": False} | options)

    def render(self, *args: Any, **kwargs: Any) -> Iterable[Segment]:
        """See rich.console.Console: text is made printable, rich's own control codes stay."""
        for segment in super().render(*args, **kwargs):
            yield segment if segment.control else Segment(printable(segment.text), segment.style)

    def status(self, status: Any, **options: Any) -> "Status":
        """See rich.console.Console, whose status would take markup."""
        return super().status(Text(status) if isinstance(status, str) else status, **options)


def words(template: str, **options: Any) -> "TextColumn":
    """A column of a progress bar, in which markup is text."""
    from rich.progress import TextColumn  # most commands show no bar

    return TextColumn(template, markup=False, **options)


def warning(text: str) -> Text:
    """As every command shows one."""
    return Text.assemble(("warning", "yellow"), " ", text)
