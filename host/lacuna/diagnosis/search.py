"""Search over sets of effects with a beam: the right effect may rank third alone and first in company."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from lacuna.diagnosis.anew import Anew
from lacuna.diagnosis.candidate import (
    LOWER,
    Candidate,
    Profile,
    finish,
    finish_elsewhere,
    finished_afresh,
    from_initial_guess,
    judge,
    profiles,
    sharpened_floor,
    sketches,
)
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.continued import led_back
from lacuna.diagnosis.crew import Crew
from lacuna.diagnosis.learn import free_form
from lacuna.diagnosis.linear import remaining_after
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import Fit, reweigh
from lacuna.estimation.noise import NoiseFloor
from lacuna.estimation.problem import Problem
from lacuna.estimation.structure import Structure
from lacuna.estimation.uncertainty import effective_samples

Enough = Callable[[Candidate], bool]

LARGEST_SET = 3
_BEAM = {1: 3, 2: 3, 3: 1}  # sets that are grown further, by their size
_SKETCHED = {1: 8, 2: 8, 3: 6}  # sets refitted, by their size: roughly,
_FROM_INITIAL_GUESS = {1: 4, 2: 1, 3: 1}  # the most promising of these from the initial guess as well,
_FINISHED = {1: 3, 2: 3, 3: 2}  # and to the end
_ROUNDS = 4  # of finishing at most
_PROFILED = 7  # effects profiled on a parent that has one already, by the gain of a linear regression
_REWEIGHED_ITERATIONS = 5
_LEAST = 3.0  # log-likelihood: gaining less, a further round of finishing is not worth it
_ABSORBED = 0.02  # a change in the residual of which less than this share is left after the base's is absorbed


@dataclass(frozen=True)
class Screened:
    """What the data could tell of an effect of typical size.

    `visible`: standard deviations that its typical size stands out by after everything that the base can
    imitate is taken off; `absorbed` if hardly anything is left. `gain`: log-likelihood that a linear
    regression of the residual on that direction would bring.
    """

    effect: str
    visible: float
    absorbed: bool
    gain: float

    @property
    def detectable(self) -> bool:
        return self.visible > 5.0 and not self.absorbed


@dataclass(frozen=True)
class Search:
    """Every explanation that was refitted, all against the same `floor`, and the screening of the library. `freed`:
    the best of each size again, with the curve that helps most where its own mechanisms act (or that curve alone, where
    it does their work)."""

    base: Candidate
    floor: NoiseFloor
    tried: tuple[Candidate, ...]
    screened: tuple[Screened, ...]
    freed: tuple[Candidate, ...] = ()

    def with_effects(self, effects: Iterable[str]) -> Candidate | None:
        wanted = frozenset(effects)
        return next((c for c in self.tried if frozenset(c.effects) == wanted), None)

    @property
    def unseen(self) -> list[str]:
        """Effects that the data would hardly show: at their typical size, nor at any other that was tried."""
        told = {c.effects for c in self.tried if self.base.cost - c.cost > _LEAST}
        return [s.effect for s in self.screened if not s.detectable and (s.effect,) not in told]

    def freed_form(self, candidate: Candidate) -> Candidate | None:
        """The same effects in a form of their own, where that explains more."""
        return next((c for c in self.freed if c.effects == candidate.effects and c.cost < candidate.cost), None)


def screen(parent: Fit, split: Split, floor: NoiseFloor) -> list[Screened]:
    """Sensitivity to each effect at its typical size, projected off what the parent's parameters can do."""
    found = []
    reference = parent.problem.residuals(parent.solution.point)
    basis, remaining = remaining_after(parent)
    for name, effect in parent.structure.system.effects.items():
        if name in parent.structure.effects:
            continue
        structure = Structure(parent.structure.system, (*parent.structure.effects, name))
        problem = Problem(structure, split.fit, floor)
        values = structure.values(
            structure.theta(structure.start())
            | parent.theta
            | {effect.full_name(p): p.value for p in effect.parameters}
        )
        values = structure.parted(values, name)
        moved = problem.residuals(problem.start(values, parent.solution.point.nuisances))
        change = np.concatenate([m - r for m, r in zip(moved, reference, strict=True)])
        left = change - basis @ (basis.T @ change)
        size, visible = float(np.linalg.norm(change)), float(np.linalg.norm(left))
        gain = 0.5 * float(left @ remaining) ** 2 / max(visible**2, 1e-300)
        found.append(Screened(name, visible, size == 0 or visible < _ABSORBED * size, gain))
    return found


def search(case: Case, first: Candidate, *, enough: Enough, crew: Crew) -> Search:
    """Grow sets from the base model, `first`, until one is `enough(candidate)`, or a further effect takes too little
    away for it to be named, or nothing promises to take its share away, or there are three effects.

    At each size, every effect is tried on every parent in the beam by its amplitude profile, the most
    promising are refitted with equal effort, and the best sets make the next beam. The best one is tried in a form of
    its own, too, before another effect joins it.
    """
    split, policy, base = case.split, case.policy, first.fitted
    floor = base.problem.floor
    screened = screen(base, split, floor)
    tried: dict[frozenset[str], Candidate] = {frozenset(): first}
    beam = [first]
    freed: list[Candidate] = []
    afar = Anew(base.structure.system, split, policy, crew)
    for size in range(1, LARGEST_SET + 1):
        if not _grow(beam, afar, split, floor, tried, enough, policy, crew):
            break
        if size == 1 and (better := _led_out(tried, split, policy)):
            crew.say("the base model was in a wrong minimum: from the better one")
            screened, tried[frozenset()] = screen(better.fitted, split, floor), better
            if enough(better):
                break
            found: dict[frozenset[str], Candidate] = {frozenset(): better}
            _grow([better], afar, split, floor, found, enough, policy, crew)
            tried |= {s: min(c, tried.get(s, c), key=lambda c: c.cost) for s, c in found.items()}
        lower = sharpened_floor(_ranked(tried, size)[0], split, floor)
        if lower.share_of(floor) < LOWER:
            floor = lower
            crew.say("weighing again against a lower floor")
            ranked = _ranked(tried, size)
            reach, grown = policy.reach * ranked[0].cost, ranked[: _BEAM[size]]
            tried = {
                s: reweighed(c, split, floor, thoroughly=not s or c in grown or c.cost < reach)
                for s, c in tried.items()
            }
            freed = [reweighed(c, split, floor) for c in freed]
        before = min(tried[frozenset(c.effects)].excess for c in beam)
        beam = _best_to_grow(tried, size, split, floor)
        best = beam[0]
        if not enough(best) and case.may_be_lost(best):
            crew.say(f"fitting {' + '.join(best.effects)} from elsewhere, too")
            best = beam[0] = tried[frozenset(best.effects)] = finished_afresh(best, split, case.seed, crew)
        gap, least = tried[frozenset()].excess, policy.promising * before
        if best.excess < policy.half * gap:  # what is found may be named: what follows must be worth naming, too
            least = max(policy.share * before, policy.share_of_gap * gap)
        if before - best.excess < least or enough(best):
            break
        if own := free_form(best, split, policy=policy, crew=crew):
            own = _finished(own, split, policy, crew)
            freed.append(own)
            if enough(own):
                break
        beam = [c for c in beam if c.excess <= policy.hopeful * best.excess]
    return Search(tried[frozenset()], floor, tuple(tried.values()), tuple(screened), tuple(freed))


def _led_out(tried: dict[frozenset[str], Candidate], split: Split, policy: Policy) -> Candidate | None:
    """The base model from where the fits with an effect lead it, if that explains more: then what these seemed to
    explain was the base fit's failure, or some of it."""
    base = tried[frozenset()]
    better = led_back(base, _ranked(tried, 1), split)
    return better if base.cost - better.cost > max(policy.promising * base.excess, _LEAST) else None


def _ranked(tried: dict[frozenset[str], Candidate], size: int) -> list[Candidate]:
    return sorted((c for s, c in tried.items() if len(s) == size), key=lambda c: c.cost)


def _best_to_grow(
    tried: dict[frozenset[str], Candidate], size: int, split: Split, floor: NoiseFloor
) -> list[Candidate]:
    """The beam, each with the derivatives that growing it takes: some may have come up as they were weighed again."""
    for candidate in _ranked(tried, size)[: _BEAM[size]]:
        if not candidate.fitted.solution.sensitivities:
            tried[frozenset(candidate.effects)] = reweighed(candidate, split, floor)
    return _ranked(tried, size)[: _BEAM[size]]


def reweighed(candidate: Candidate, split: Split, floor: NoiseFloor, *, thoroughly: bool = True) -> Candidate:
    """The same explanation against another floor, fitted from where it stands if it is to be done thoroughly."""
    steps = _REWEIGHED_ITERATIONS if thoroughly else 0
    return judge(
        reweigh(candidate.fitted, floor, max_iterations=steps), split, candidate.policy, near=candidate.checked
    )


def _grow(
    beam: Sequence[Candidate],
    afar: Anew,
    split: Split,
    floor: NoiseFloor,
    tried: dict[frozenset[str], Candidate],
    enough: Enough,
    policy: Policy,
    crew: Crew,
) -> list[Candidate]:
    """Every parent of the beam with one effect more: the most promising of all, with equal effort."""
    size = len(beam[0].effects) + 1
    profiled: dict[frozenset[str], Profile] = {}
    effects = beam[0].fitted.structure.system.effects
    for parent in beam:
        fresh = [e for e in effects if e not in parent.effects and frozenset((*parent.effects, e)) not in tried]
        if parent.effects:
            gains = {s.effect: s.gain for s in screen(parent.fitted, split, floor)}
            # a regression knows nothing of values that each trial has of its own, nor of what does nothing as yet
            blind = [e for e in fresh if effects[e].own or effects[e].apart]
            fresh = [*blind, *sorted((e for e in fresh if e not in blind), key=lambda e: -gains[e])[:_PROFILED]]
        least = policy.promising * max(parent.fitted.cost - 0.5 * effective_samples(parent.fitted), 0.0)
        for found in profiles(parent.fitted, fresh, split, floor, crew):
            # what does nothing as yet may need the rest to give way first
            if parent.effects and parent.fitted.cost - found.cost < least and not effects[found.effect].apart:
                continue
            same = frozenset(found.problem.structure.effects)
            if same not in profiled or found.cost < profiled[same].cost:
                profiled[same] = found
    ranked = sorted(profiled.values(), key=lambda p: p.cost)
    before = min(beam, key=lambda c: c.cost)
    sketched, finished = _sketched(before, ranked, afar, split, enough, policy, crew)
    return _finish(before, sketched, finished, _FINISHED[size], split, tried, enough, policy, crew)


def _sketched(
    before: Candidate,
    ranked: Sequence[Profile],
    afar: Anew,
    split: Split,
    enough: Enough,
    policy: Policy,
    crew: Crew,
) -> tuple[list[tuple[Fit, Profile]], Candidate | None]:
    """A quick refit of the most promising, the best first; and the best one finished, if it leaves little. Where that
    explains enough, those that could reach it are refitted from the initial guess as well; where it does not, the most
    promising of all, and where the set before leaves so much that it may be in the wrong minimum, effects are begun
    anew."""
    size = len(before.effects) + 1
    near = sketches([p for k, p in enumerate(ranked) if k < _SKETCHED[size] or p.apart], crew)
    if not near:  # at no size of theirs, the rest hardly refitted, do effects help: that says little of a lost fit
        return _best_of_each(afar.follow(before)) if before.checked_error > (0, policy.lost) else [], None
    first = judge(near[0][0], split, policy, near=before.checked)
    finished: Candidate | None = None
    fruitful = before.cost - first.cost > policy.promising * before.excess
    if fruitful and first.checked_error <= (0, policy.lost):
        first = finished = _finished(first, split, policy, crew)
        near[0] = first.fitted, near[0][1]
    most = _FROM_INITIAL_GUESS[size]
    if enough(first):
        reach = policy.reach * first.fitted.cost
        far = from_initial_guess([pair for pair in near[1:] if pair[0].cost < reach], crew, most)
    elif before.checked_error > (0, policy.lost):
        fresh = afar.follow(before)
        begun = {frozenset(fitted.structure.effects) for fitted, _ in fresh}
        reach = min((policy.hopeless * fitted.cost for fitted, _ in fresh), default=np.inf)
        left = [pair for pair in near if frozenset(pair[0].structure.effects) not in begun and pair[0].cost < reach]
        far = [*from_initial_guess(left, crew, max(most - len(fresh), 1)), *fresh]
    else:
        far = from_initial_guess(near, crew, most)
    return _best_of_each([*near, *far]), finished


def _best_of_each(sketched: Sequence[tuple[Fit, Profile]]) -> list[tuple[Fit, Profile]]:
    """The best fit of each set of effects, the best set first."""
    best: dict[frozenset[str], tuple[Fit, Profile]] = {}
    for fitted, profile in sketched:
        effects = frozenset(fitted.structure.effects)
        if effects not in best or fitted.cost < best[effects][0].cost:
            best[effects] = (fitted, profile)
    return sorted(best.values(), key=lambda pair: pair[0].cost)


def _finished(candidate: Candidate, split: Split, policy: Policy, crew: Crew) -> Candidate:
    """From the initial guess again for as long as that pays: a friction in the wrong minimum may need to restart more
    than once."""
    crew.say(f"finishing {' + '.join(candidate.effects)}")
    for _ in range(_ROUNDS):
        further = judge(finish(candidate.fitted), split, candidate.policy, near=candidate.checked)
        fruitful = candidate.cost - further.cost > max(policy.promising * candidate.excess, _LEAST)
        candidate = min(candidate, further, key=lambda c: c.cost)
        if not fruitful:
            break
    return candidate


def _finish(
    before: Candidate,
    sketched: Sequence[tuple[Fit, Profile]],
    finished: Candidate | None,
    count: int,
    split: Split,
    tried: dict[frozenset[str], Candidate],
    enough: Enough,
    policy: Policy,
    crew: Crew,
) -> list[Candidate]:
    """Refit to the end the best `count` of those that explain more than the best set so far, `before`, but for the one
    that is `finished` already; once one of them explains enough, only those that are not out of its reach. What does
    not explain enough gets a second start, so that it is not the optimiser who failed."""
    grown = [
        finished
        if finished and fitted.solution is finished.fitted.solution
        else judge(fitted, split, policy, near=before.checked)
        for fitted, _ in sketched
    ]
    profiled = {candidate.effects: profile for candidate, (_, profile) in zip(grown, sketched, strict=True)}
    waiting = sorted(grown, key=lambda c: c.cost)
    done: list[Candidate] = []
    explained = np.inf
    while waiting and len(done) < count:
        candidate = waiting[0]
        most = max(before.excess, *(before.cost - c.cost for c in done), 0.0)
        fruitful = before.cost - candidate.cost > policy.promising * most
        hopeless = done and candidate.excess > policy.hopeless * min(c.excess for c in done)
        if not fruitful or hopeless or candidate.cost > policy.reach * explained:
            break
        waiting.pop(0)
        if candidate is not finished:
            candidate = _finished(candidate, split, policy, crew)
        suffices = enough(candidate)
        if not suffices:
            other = finish_elsewhere(candidate.fitted, profiled[candidate.effects], crew)
            candidate = judge(other, split, candidate.policy, near=candidate.checked)
            suffices = enough(candidate)
        if suffices:
            explained = min(explained, candidate.cost)
        done.append(candidate)
    for candidate in (*done, *waiting):
        same = frozenset(candidate.effects)
        tried[same] = min(tried.get(same, candidate), candidate, key=lambda c: c.cost)
    return [*done, *waiting]
