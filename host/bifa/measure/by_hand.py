"""A bench with a lab's own instruments: each trial is announced, recorded, shown, and kept or repeated.

`ByHand` is the `Recorder` of such a session, which otherwise runs as on any rig.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from bifa.check import check_trial
from bifa.check.lag import trial_misfit
from bifa.data import DatasetWriter, Trial
from bifa.data.export import Export
from bifa.data.layout import RAW
from bifa.errors import BifaError
from bifa.link import LinkError, PortGoneError, RefusedError, Uno
from bifa.measure.desk import Desk, NobodyError
from bifa.measure.experiments import Progress, record_trial
from bifa.measure.instrument_csv import InstrumentFileError
from bifa.measure.own_instruments import OwnInstruments
from bifa.measure.plan import Turn
from bifa.measure.recording import Bench, idle, unlinked
from bifa.measure.text_plot import text_plot
from bifa.rig import Rig

_REPEAT = ("r", "repeat")
_LOOK_S = 0.25


class ByHand:
    """The `Recorder` of a rig whose instruments a person operates. `plain`: whether the terminal shows only ASCII;
    `columns`: its width; `exports()`: how the instruments write their files, where declared. The attribute `before` is
    called before each trial, so that no progress bar redraws itself over questions and answers."""

    def __init__(
        self,
        desk: Desk,
        watch: Path | None = None,
        plain: bool = False,
        exports: Callable[[], Mapping[str, Export]] = dict,
        columns: int = 80,
    ) -> None:
        self._desk, self._plain, self._columns = desk, plain, columns
        self._instruments = OwnInstruments(desk, watch, exports)
        self.before: Callable[[], None] = lambda: None

    def __call__(self, rig: Rig, uno: Uno, turn: Turn, on_progress: Progress, writer: DatasetWriter) -> Trial:
        """Record one trial, repeated until the person keeps it; see session.Recorder.

        Raises KeyboardInterrupt if the answer is a stop.
        """
        self.before()
        self._instruments.begin(turn, writer.partial / RAW)
        bench = Bench(self._instruments, rig.clock)
        try:
            while True:
                self._desk.say(f"\nTrial {turn.number} of {turn.total}: {turn.planned.title}")
                try:
                    trial = record_trial(bench, uno, turn.planned, on_progress, attempts=1)
                except BifaError as error:
                    is_refused = isinstance(error, RefusedError)  # a LinkError that the person can do something about
                    if isinstance(error, (LinkError, PortGoneError, NobodyError)) and not is_refused:
                        raise
                    self._try_again(bench, uno, turn, error)
                    continue
                if self._accepted(bench, uno, turn, trial, writer):
                    try:
                        self._instruments.keep(writer.partial / RAW)
                        return trial
                    except InstrumentFileError as error:
                        self._try_again(bench, uno, turn, error)
        finally:
            self._desk.clear()

    def _try_again(self, bench: Bench, uno: Uno, turn: Turn, error: BifaError) -> None:
        """Say why a trial is not usable, until the person wants to try again and nothing forbids that any longer."""
        uno.halt()
        while True:
            self._review(bench, uno, turn, f"Not usable: {error}.", "Enter tries again")
            try:
                return uno.clear()  # it may have been stopped; the next prompt asks whether valves may switch
            except RefusedError as refusal:
                error = refusal

    def _accepted(self, bench: Bench, uno: Uno, turn: Turn, trial: Trial, writer: DatasetWriter) -> bool:
        for line in text_plot(trial, self._plain, self._columns):
            self._desk.say(line)
        wrong = [str(finding) for finding in check_trial(trial)]
        if misfit := trial_misfit(trial, writer.trials):
            wrong.append(misfit)
        seen = "\n".join(f"Looks wrong: {text}" for text in wrong) or "Nothing looks wrong."
        return self._review(bench, uno, turn, seen, "Enter keeps it, r repeats it", wrong)

    def _review(self, bench: Bench, uno: Uno, turn: Turn, seen: str, choice: str, findings: Sequence[str] = ()) -> bool:
        """Ask for a decision: True if the answer is Enter, False if it is to repeat."""
        about = turn.as_dict() | {"findings": list(findings)}
        self._desk.ask("review", f"{seen} {choice}, q discards it and stops.", about)
        while True:
            while (answer := self._desk.answer()) is None:
                with unlinked(bench.clock, _LOOK_S):
                    idle(bench, uno, _LOOK_S)
            if not answer or answer.lower() in _REPEAT:
                return not answer
            self._desk.again(answer, choice)
