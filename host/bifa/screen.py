"""The console that commands print on."""

from collections.abc import Iterable
from typing import Any

import rich.console
from rich.segment import Segment

from bifa.printable import printable


class Console(rich.console.Console):
    """Rich's, which obeys no escape sequence that stands in what it is given."""

    def render(self, *args: Any, **kwargs: Any) -> Iterable[Segment]:
        """See rich.console.Console: text is made printable, rich's own control codes stay."""
        for segment in super().render(*args, **kwargs):
            yield segment if segment.control else Segment(printable(segment.text), segment.style)
