"""A search that is interrupted (Ctrl-C) still gives a verdict, from what it had finished by then."""

from __future__ import annotations

from collections.abc import Callable

from lacuna.diagnosis.candidate import Candidate
from lacuna.diagnosis.search import Search, reweighed, screen
from lacuna.diagnosis.split import Split

STOPPED = "The search was stopped by hand: the verdict is based on the best result found so far."


class Finished:
    """Keeps each set of effects that the search has fitted to the end, whenever it asks whether that is enough."""

    def __init__(self, enough: Callable[[Candidate], bool]):
        self._enough = enough
        self.candidates: list[Candidate] = []

    def __call__(self, candidate: Candidate) -> bool:
        if not candidate.fitted.structure.sites:
            self.candidates.append(candidate)
        return self._enough(candidate)

    def search(self, base: Candidate, split: Split) -> Search:
        """What the search would have returned: the best candidate for each set, all against the latest floor."""
        floor = (self.candidates[-1] if self.candidates else base).fitted.problem.floor
        found: dict[frozenset[str], Candidate] = {}
        for one in (base, *self.candidates):
            same = one if one.fitted.problem.floor is floor else reweighed(one, split, floor)
            known = found.setdefault(frozenset(one.effects), same)
            found[frozenset(one.effects)] = min(known, same, key=lambda c: c.cost)
        first = found[frozenset()]
        return Search(first, floor, tuple(found.values()), tuple(screen(first.fitted, split, floor)))
