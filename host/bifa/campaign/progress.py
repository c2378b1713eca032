"""Progress of a campaign for people: one line a stage, a bar for the stage that runs."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from bifa.campaign.stages import Stage
from bifa.screen import Console


class StageProgress:
    """Hand `start` and `end` to `run_stages`, `part` to what happens inside a stage."""

    def __init__(self, bars: Progress) -> None:
        self._bars = bars
        self._task = None

    def start(self, stage: Stage) -> None:
        """A stage begins."""
        self._task = self._bars.add_task(stage.title, total=None, what="")

    def part(self, what: str, share: float) -> None:
        """`what` inside the running stage is done to `share`, 0 to 1."""
        self._bars.update(self._task, total=1.0, completed=min(share, 0.999), what=what)

    def end(self, stage: Stage, ran: bool) -> None:
        """A stage is done; ran: it was not up to date already."""
        self._bars.update(self._task, total=1.0, completed=1.0, what="done" if ran else "up to date")


@contextmanager
def stage_progress(console: Console) -> Iterator[StageProgress]:
    """Bars that redraw themselves on a terminal and end as plain lines elsewhere."""
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=28),
        TextColumn("{task.fields[what]}"),
        TimeElapsedColumn(),
        console=console,
    ) as bars:
        yield StageProgress(bars)
