"""Fits that owe nothing to earlier ones, begun and judged from a distance.

The trials that isolate parameters are a tenth of the work and are fitted first. All trials together, smoothed and
weighed loosely, then tell by orders of magnitude which of several beginnings is near, though nothing has been fitted to
most of them yet (`lacuna.estimation.graduated`); only the few that promise most are followed to the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from lacuna.diagnosis.crew import Crew
from lacuna.estimation.graduated import Isolated, fit_isolated, fit_together, glance
from lacuna.estimation.problem import Problem
from lacuna.estimation.solve import Solution

SKETCH: dict[str, Any] = {"max_iterations": 12, "relative": 3e-3}


class Begun(NamedTuple):
    """An explanation after the isolated trials; `glanced`: the cost of all trials from a distance, or, where all of
    them isolate parameters, as they have been fitted."""

    problem: Problem
    isolated: Isolated
    glanced: float

    def against(self, problem: Problem) -> Begun:
        """The same beginning weighed by another problem, one with another floor."""
        return Begun(problem, self.isolated, _glanced(problem, self.isolated))


def begin(crew: Crew, doing: str, problems: Sequence[Problem], starts: Sequence[Sequence[np.ndarray]]) -> list[Begun]:
    """Each of `problems` from the best of its own starts (vectors of its structure)."""
    found = crew.map(doing, _names(problems), _begun, list(zip(problems, starts, strict=True)))
    return [Begun(problem, *one) for problem, one in zip(problems, found, strict=True)]


def promising(begun: Sequence[Begun], most: int) -> list[Begun]:
    """The `most` that cost least from a distance, the best first; all of them where no trial isolates parameters, since
    then nothing tells."""
    ranked = sorted(begun, key=lambda one: one.glanced)
    return ranked[:most] if any(any(isolating(one.problem)) for one in ranked) else ranked


def follow(crew: Crew, doing: str, chosen: Sequence[Begun]) -> list[Solution]:
    """All trials fitted for as long as it pays quickly."""
    problems = [one.problem for one in chosen]
    return crew.map(doing, _names(problems), _followed, [(one.problem, one.isolated) for one in chosen])


def isolating(problem: Problem) -> list[bool]:
    """Of each trial, whether it isolates parameters."""
    return [problem.structure.system.isolates(trial) for trial in problem.trials]


def _names(problems: Sequence[Problem]) -> list[tuple[str, ...]]:
    each = ((*problem.structure.effects, *problem.structure.sites) for problem in problems)
    return [names or ("nothing",) for names in each]


def _begun(problem: Problem, starts: Sequence[np.ndarray]) -> tuple[Isolated, float]:
    found = [fit_isolated(problem, start) for start in starts]
    return min(((one, _glanced(problem, one)) for one in found), key=lambda pair: pair[1])


def _glanced(problem: Problem, begun: Isolated) -> float:
    return begun.cost if all(isolating(problem)) else glance(problem, begun.values)


def _followed(problem: Problem, begun: Isolated) -> Solution:
    return fit_together(problem, begun, **SKETCH)
