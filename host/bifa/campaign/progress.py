"""Progress of a campaign on the terminal: one line per stage, a bar for the running one."""

from rich.progress import BarColumn, Progress, TaskID, TimeElapsedColumn
from rich.table import Column

from bifa.campaign.stages import Stage
from bifa.screen import Console, words

_TITLE = 35  # characters: the longest title of a stage


class StageProgress:
    """Progress bars that are redrawn on a terminal and printed as plain lines elsewhere. Use in `contextlib.closing`;
    pass `start` and `end` to `run_stages`, and `update` to whatever runs inside a stage.

    `close` it before a person is prompted: a bar would be redrawn over questions and answers.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._title = ""
        self._bars: Progress | None = None
        self._task = TaskID(0)

    def start(self, stage: Stage) -> None:
        """A stage begins."""
        self._title = stage.title
        if stage.by_hand:
            self._console.print(stage.title)
        else:
            self._begin()

    def _begin(self) -> Progress:
        wide = self._console.width
        self._bars = bars = Progress(
            words("{task.description}", table_column=Column(min_width=min(_TITLE, wide // 3), no_wrap=False)),
            BarColumn(bar_width=min(20, wide // 8)),
            words("{task.fields[what]}", table_column=Column(no_wrap=False)),  # wraps on a narrow terminal
            TimeElapsedColumn(),
            console=self._console,
        )
        self._task = bars.add_task(self._title, total=None, what="")
        bars.start()
        return bars

    def update(self, what: str, share: float) -> None:
        """The step `what` of the running stage is done to `share`, 0 to 1."""
        bars = self._bars or self._begin()
        bars.update(self._task, total=1.0, completed=min(share, 0.999), what=what)

    def end(self, stage: Stage, ran: bool) -> None:
        """A stage has ended; ran: whether it had to run or was already up to date."""
        said = "done" if ran else "up to date"
        if self._bars is None:
            self._console.print(f"{stage.title}: {said}")
            return
        self._bars.update(self._task, total=1.0, completed=1.0, what=said)
        self.close()

    def close(self) -> None:
        """Stop redrawing; what has been drawn stays."""
        if self._bars is not None:
            self._bars.stop()
            self._bars = None
