"""A diagnosis that is interrupted (Ctrl-C) still gives a verdict, from what it had finished by then."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from lacuna.diagnosis.candidate import Candidate
from lacuna.diagnosis.score import score
from lacuna.diagnosis.search import Search, keep_best, reweighed
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Workers

STOPPED = "The search was stopped by hand: the verdict is based on the best result found so far."

Answer = TypeVar("Answer")


class Stoppable:
    """A diagnosis in steps: once Ctrl-C has stopped it, every further step gives its short answer. `stopped`: whether
    that has happened."""

    def __init__(self, workers: Workers) -> None:
        self.workers, self.stopped = workers, False

    def on_progress(self, what: str) -> None:
        """Once stopped, nothing: what was said of that stays to be read."""
        if not self.stopped:
            self.workers.on_progress(what)

    def ask(self, full: Callable[[], Answer], short: Callable[[], Answer], said: str) -> Answer:
        """The full answer; where it is stopped, `said` is shown, and the answer is short."""
        if not self.stopped:
            try:
                return full()
            except KeyboardInterrupt:
                self.workers.on_progress(f"stopped: {said} (Ctrl-C again gives up)")
                self.stopped = True
        return short()


class Found:
    """Keeps what the search has fitted, until somebody stops it."""

    def __init__(self) -> None:
        self.candidates: list[Candidate] = []

    def keep(self, candidates: Sequence[Candidate]) -> None:
        self.candidates += candidates

    def search(self, base: Candidate, split: Split) -> Search:
        """What the search would have returned: the best candidate for each set, all against the latest floor."""
        floor = (self.candidates[-1] if self.candidates else base).fitted.problem.floor
        found: dict[frozenset[str], Candidate] = {}
        all_of_them = (base, *self.candidates)
        keep_best(found, (c if c.fitted.problem.floor is floor else reweighed(c, split, floor) for c in all_of_them))
        first = found[frozenset()]
        screened = score(first.fitted, list(first.fitted.structure.system.effects), Workers(lambda _: None)).screened()
        return Search(first, floor, tuple(found.values()), screened)
