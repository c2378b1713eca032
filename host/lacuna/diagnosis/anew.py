"""Explanations that owe nothing to what was fitted before: begun at the initial guess, and judged from a distance.

A base model that lacks much may be so badly fitted that no size of what it lacks improves it, and what continues from
there inherits the failure. The trials that isolate parameters are quickly fitted with any set of effects. All trials
together, smoothed and weighed loosely, then say which set is right, though nothing has been fitted to most of them yet
(`lacuna.estimation.graduated`); only the few that promise most are followed to the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lacuna.diagnosis.candidate import SKETCH, Candidate, Profile, sized
from lacuna.diagnosis.crew import Crew
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import Fit, best_of
from lacuna.estimation.graduated import Isolated, fit_isolated, fit_together, glance
from lacuna.estimation.noise import NoiseFloor
from lacuna.estimation.problem import Problem
from lacuna.estimation.solve import Solution
from lacuna.estimation.structure import Structure
from lacuna.system import System

_FOLLOWED = {1: 4, 2: 2}  # to the end, by the size of the set
_SEEDS = 2  # sets that the next ones grow from
_SIZES = (1.0, 0.15)  # times an effect's typical size: where it is begun


class _Begun(NamedTuple):
    """A set of effects after the isolated trials; `glanced`: the cost of all trials from a distance, or, where all of
    them isolate parameters, as they have been fitted."""

    problem: Problem
    isolated: Isolated
    glanced: float


@dataclass
class Anew:
    """Begins sets of effects anew, each once."""

    system: System
    split: Split
    policy: Policy
    crew: Crew
    _begun: dict[frozenset[str], _Begun] = field(default_factory=dict)

    def follow(self, before: Candidate) -> list[tuple[Fit, Profile]]:
        """Sketches of sets with one effect more than `before`: the few that promise most, if they promise to take their
        share away. Pairs are only begun where it is other trials that may have misled the fits of single effects; where
        no trial isolates parameters, nothing tells, and every single effect is followed."""
        size, floor = len(before.effects) + 1, before.fitted.problem.floor
        if size > 2 or (size == 2 and not self._mixed):
            return []
        self._weigh(floor)
        self._begin([()], floor)
        for smaller in range(size):
            seeds = [begun.problem.structure.effects for begun in self._leading(smaller)[:_SEEDS]]
            self._begin([(*seed, e) for seed in seeds for e in self.system.effects if e not in seed], floor)
        chosen = self._leading(size)
        if any(self._isolates):
            most = (1.0 - self.policy.promising) * self._leading(size - 1)[0].glanced
            chosen = [begun for begun in chosen[: _FOLLOWED[size]] if begun.glanced < most]
        names = [begun.problem.structure.effects for begun in chosen]
        jobs = [(begun.problem, begun.isolated) for begun in chosen]
        found = self.crew.map("following up", names, _followed, jobs)
        return [_sketch(begun.problem, solution) for begun, solution in zip(chosen, found, strict=True)]

    @cached_property
    def _isolates(self) -> list[bool]:
        return [self.system.isolates(trial) for trial in self.split.fit]

    @property
    def _mixed(self) -> bool:
        return any(self._isolates) and not all(self._isolates)

    def _leading(self, size: int) -> list[_Begun]:
        """Sets of so many effects, the most promising first."""
        return sorted((b for s, b in self._begun.items() if len(s) == size), key=lambda b: b.glanced)

    def _weigh(self, floor: NoiseFloor) -> None:
        """What has been begun against another floor, as it is against this one."""
        for effects, (problem, isolated, _) in self._begun.items():
            if problem.floor is not floor:
                again = Problem(problem.structure, self.split.fit, floor)
                self._begun[effects] = _Begun(again, isolated, _glanced(again, isolated, self._mixed))

    def _begin(self, sets: Sequence[tuple[str, ...]], floor: NoiseFloor) -> None:
        new = {frozenset(effects): effects for effects in sets if frozenset(effects) not in self._begun}
        problems = [Problem(Structure(self.system, effects), self.split.fit, floor) for effects in new.values()]
        names = [effects or ("nothing",) for effects in new.values()]
        jobs = [(problem, self._starts(problem.structure), self._mixed) for problem in problems]
        found = self.crew.map("restarting with", names, _isolated, jobs)
        self._begun |= {s: _Begun(p, *pair) for s, p, pair in zip(new, problems, found, strict=True)}

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


def _isolated(problem: Problem, starts: Sequence[np.ndarray], mixed: bool) -> tuple[Isolated, float]:
    found = [fit_isolated(problem, start) for start in starts]
    return min(((one, _glanced(problem, one, mixed)) for one in found), key=lambda pair: pair[1])


def _glanced(problem: Problem, isolated: Isolated, mixed: bool) -> float:
    return glance(problem, isolated.values) if mixed else isolated.cost


def _followed(problem: Problem, begun: Isolated) -> Solution:
    return fit_together(problem, begun, **SKETCH)


def _sketch(problem: Problem, solution: Solution) -> tuple[Fit, Profile]:
    fitted = best_of(problem, [solution])
    return fitted, Profile(problem.structure.effects[-1], problem, fitted.cost, (solution.point,))
