"""Explanations that owe nothing to what was fitted before: begun at the initial guess, and judged from a distance.

A base model that lacks much may be so badly fitted that no size of what it lacks improves it, and what continues from
there inherits the failure. So sets of effects are begun anew, each at its typical size and at a fraction of it, and the
few that promise most are followed to the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from lacuna.diagnosis.candidate import Candidate, Profile, sized
from lacuna.diagnosis.crew import Crew
from lacuna.diagnosis.from_afar import Begun, begin, follow, isolating, promising
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import Fit, best_of
from lacuna.estimation.noise import NoiseFloor
from lacuna.estimation.problem import Problem
from lacuna.estimation.solve import Solution
from lacuna.estimation.structure import Structure
from lacuna.system import System

_FOLLOWED = {1: 4, 2: 2}  # to the end, by the size of the set
_SEEDS = 2  # sets that the next ones grow from
_SIZES = (1.0, 0.15)  # times an effect's typical size: where it is begun


@dataclass
class Anew:
    """Begins sets of effects anew, each once."""

    system: System
    split: Split
    policy: Policy
    crew: Crew
    _begun: dict[frozenset[str], Begun] = field(default_factory=dict)

    def follow(self, before: Candidate) -> list[tuple[Fit, Profile]]:
        """Sketches of sets with one effect more than `before`: the few that promise most, if they promise to take their
        share away. Pairs only where there are trials that isolate parameters: elsewhere, nothing tells of so many."""
        size, problem = len(before.effects) + 1, before.fitted.problem
        isolates = isolating(problem)
        if size > 2 or (size == 2 and not any(isolates)):
            return []
        self._weigh(problem.floor)
        self._begin([()], problem.floor)
        for smaller in range(size):
            seeds = self._seeds(smaller)
            self._begin([(*seed, e) for seed in seeds for e in self.system.effects if e not in seed], problem.floor)
        chosen = promising(self._leading(size), _FOLLOWED[size])
        if any(isolates):
            most = (1.0 - self.policy.promising) * self._leading(size - 1)[0].glanced
            chosen = [begun for begun in chosen if begun.glanced < most]
        found = follow(self.crew, "following up", chosen)
        return [_sketch(begun.problem, solution) for begun, solution in zip(chosen, found, strict=True)]

    def _seeds(self, size: int) -> list[tuple[str, ...]]:
        """Sets of so many effects that larger ones grow from."""
        leading = self._leading(size)[:_SEEDS]
        hopeful = [one for one in leading if one.glanced <= self.policy.hopeful * leading[0].glanced]
        return [one.problem.structure.effects for one in hopeful]

    def _leading(self, size: int) -> list[Begun]:
        """Sets of so many effects, the most promising first."""
        return sorted((b for s, b in self._begun.items() if len(s) == size), key=lambda b: b.glanced)

    def _weigh(self, floor: NoiseFloor) -> None:
        """What has been begun against another floor, as it is against this one."""
        for effects, one in self._begun.items():
            if one.problem.floor is not floor:
                self._begun[effects] = one.against(Problem(one.problem.structure, self.split.fit, floor))

    def _begin(self, sets: Sequence[tuple[str, ...]], floor: NoiseFloor) -> None:
        new = {frozenset(effects): effects for effects in sets if frozenset(effects) not in self._begun}
        problems = [Problem(Structure(self.system, effects), self.split.fit, floor) for effects in new.values()]
        starts = [self._starts(problem.structure) for problem in problems]
        self._begun |= zip(new, begin(self.crew, "restarting with", problems, starts), strict=True)

    def _starts(self, structure: Structure) -> list[np.ndarray]:
        """The initial guess, the last effect at its typical size and a fraction of it, of either sign, those before it
        as they were begun. From its typical size an effect may lead astray what it is to be fitted with."""
        if not structure.effects:
            return [structure.start()]
        *others, last = structure.effects
        start = structure.theta(structure.start())
        if others:
            problem, isolated, _ = self._begun[frozenset(others)]
            known = problem.structure.theta(isolated.values)
            start |= {name: value for name, value in known.items() if name.split(".")[0] in others}
        base = structure.parted(structure.values(start), last)
        return [vector for factor in _SIZES for vector in sized(structure, base, last, factor)]


def _sketch(problem: Problem, solution: Solution) -> tuple[Fit, Profile]:
    fitted = best_of(problem, [solution])
    return fitted, Profile(problem.structure.effects[-1], problem, fitted.cost, (solution.point,))
