"""Search over sets of effects: score them, race the most promising, and score further effects on top of the best."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

from lacuna.diagnosis.candidate import Candidate, judge, refitted_without, sharpened_floor
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.learn import free_form
from lacuna.diagnosis.race import NEAR, joined, race, refit_multi_start
from lacuna.diagnosis.score import Promise, Scores, Screened, score
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Workers
from lacuna.estimation.fit import reweigh
from lacuna.estimation.noise import MAX_REESTIMATES, REFIT_SHARE, NoiseFloor
from lacuna.estimation.solve import cost_of

LARGEST_SET = 3
_RACED = {1: 6, 2: 6, 3: 4}  # number of sets raced, by set size,
_FINISHED = {1: 3, 2: 3, 3: 1}  # and of these the number fitted to convergence
_PARENTS, _JOINED = 2, 3  # number of best sets that larger ones grow from, and that are joined in pairs
_REWEIGHED_ITERATIONS = 5
_MIN_GAIN = 3.0  # log-likelihood: an effect that gains less counts as not seen


@dataclass(frozen=True)
class Search:
    """Every explanation that was fitted, all against the same `floor`, and the screening of the library. `freed`: of
    each size the best set with the most helpful learnt curve where its mechanisms act (or that curve alone)."""

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
        """Effects that the data would hardly show, neither at their typical size nor at any other size tried."""
        gaining = {c.effects for c in self.tried if self.base.cost - c.cost > _MIN_GAIN}
        return [s.effect for s in self.screened if not s.detectable and (s.effect,) not in gaining]

    def freed_form(self, candidate: Candidate) -> Candidate | None:
        """The same effects in freed form, if that explains more; otherwise None."""
        same = frozenset(candidate.effects)
        return next((c for c in self.freed if frozenset(c.effects) == same and c.cost < candidate.cost), None)


def search(
    case: Case,
    first: Candidate,
    *,
    enough: Callable[[Candidate], bool],
    workers: Workers,
    keep: Callable[[Sequence[Candidate]], None] = lambda _: None,
) -> Search:
    """Race single effects, then pairs, then sets of three, until a set satisfies `enough(candidate)` or no larger set
    promises to remove its share of what is left. Before the best set of a size grows, it is also fitted from other
    starts if it leaves little, and tried in freed form. `keep` is called with every batch of candidates, so that they
    survive an interruption."""
    split, floor = case.split, first.fitted.problem.floor

    def raced(parent: Candidate, promises: Sequence[Promise]) -> list[Candidate]:
        size = len(promises[0].problem.structure.effects) if promises else 1
        return race(parent, promises, _FINISHED[size], split=split, enough=enough, workers=workers, keep=keep)

    scores = score(first.fitted, list(case.system.effects), workers)
    tried: dict[frozenset[str], Candidate] = {frozenset(): first}
    freed: list[Candidate] = []
    found = raced(first, _singles(case, scores))
    if better := escape_local_optimum(first, found, split):
        workers.on_progress("the base model was in a local optimum: continuing from a better one")
        keep([better])
        if enough(better):
            return Search(better, floor, (better, *found), scores.screened())
        scores, tried[frozenset()] = score(better.fitted, list(case.system.effects), workers), better
        begun = {one.effects for one in found}  # they began cold, so the base model's optimum did not affect them
        found += raced(better, [e for e in _singles(case, scores) if e.problem.structure.effects not in begun])
    keep_best(tried, found)
    for size in range(1, LARGEST_SET + 1):
        ranked = _ranked(tried, size)
        if not ranked:
            break
        for _ in range(1 if case.has_factors else MAX_REESTIMATES):
            lower = sharpened_floor(ranked[0], split, floor)
            if lower.share_of(floor) >= REFIT_SHARE:
                break
            workers.on_progress("weighing again against a lower floor")
            floor = lower
            # the base model and what may still win are refitted
            near, leading = case.policy.reach * ranked[0].cost, ranked[:_PARENTS]
            tried = {
                s: reweighed(c, split, lower, thoroughly=not s or c in leading or c.cost < near)
                for s, c in tried.items()
            }
            freed = [reweighed(c, split, lower) for c in freed]
            ranked = _ranked(tried, size)
        if enough(ranked[0]):
            break
        if case.nearly(ranked[0]):  # it may be in a local optimum
            better = refit_multi_start(ranked[0], split, case.seed, workers)
            keep([better])
            keep_best(tried, [better])
            ranked = _ranked(tried, size)
            if enough(ranked[0]):
                break
        if own := free_form(ranked[0], split, workers):
            freed.append(own)
            if ranked[0].left < case.policy.half * tried[frozenset()].left and enough(own):
                break
        promises = _larger(case, tried, ranked, workers) if size < LARGEST_SET else []
        if not promises:
            break
        found = raced(ranked[0], promises)
        keep_best(tried, found)
        keep_best(tried, better_subsets(case, tried, found))
    return Search(tried[frozenset()], floor, tuple(tried.values()), scores.screened(), tuple(freed))


def interrupted_search(base: Candidate, kept: Sequence[Candidate], split: Split) -> Search:
    """An interrupted search: for each set of effects the best of `kept`, all against the latest floor."""
    floor = (kept[-1] if kept else base).fitted.problem.floor
    tried: dict[frozenset[str], Candidate] = {}
    keep_best(tried, (c if c.fitted.problem.floor is floor else reweighed(c, split, floor) for c in (base, *kept)))
    first = tried[frozenset()]
    screened = score(first.fitted, list(first.fitted.structure.system.effects), Workers(lambda _: None)).screened()
    return Search(first, floor, tuple(tried.values()), screened)


def keep_best(tried: dict[frozenset[str], Candidate], found: Iterable[Candidate]) -> None:
    """Add `found` to `tried`, keeping the cheapest candidate for each set of effects."""
    for one in found:
        same = frozenset(one.effects)
        tried[same] = min(tried.get(same, one), one, key=lambda c: c.cost)


def better_subsets(
    case: Case, tried: dict[frozenset[str], Candidate], found: Sequence[Candidate]
) -> Iterator[Candidate]:
    """Sets in which an effect has vanished, refitted without it, if they cost less than the smaller set that was tried:
    with more effects its fit found a better optimum."""
    library = case.system.effects
    for one in found:
        theta = one.fitted.theta
        kept = [e for e in one.effects if any(theta[name] != library[e].absent for name in library[e].size_names)]
        same = tried.get(frozenset(kept))
        if len(kept) < len(one.effects) and (same is None or same.cost - one.cost > _MIN_GAIN):
            yield refitted_without(one, kept, case.split)


def _ranked(tried: dict[frozenset[str], Candidate], size: int) -> list[Candidate]:
    return sorted((c for s, c in tried.items() if len(s) == size), key=lambda c: c.cost)


def _singles(case: Case, scores: Scores) -> list[Promise]:
    """The effects with the best scores, the suspected ones, and those that a score may miss: they have values of their
    own in every trial or a frequency, or do nothing at the parent's parameters (`Effect.apart`)."""
    chosen = []
    for rank, one in enumerate(scores.singles()):
        effect, suspected = case.system.effects[one.effect], one.effect in case.suspected
        if rank < _RACED[1] or suspected or effect.own or effect.apart or effect.frequency:
            chosen.append(one._replace(suspected=suspected))
    return chosen


def _larger(
    case: Case, tried: dict[frozenset[str], Candidate], ranked: Sequence[Candidate], workers: Workers
) -> list[Promise]:
    """Sets with one more effect, the most promising first. They grow from the best sets by score; the very best one
    also grows by suspected effects and by those that do nothing yet (`Effect.apart`). The best sets are also joined in
    pairs, since an effect whose place another has taken, such as a limit, promises nothing beside it. Empty if no set
    promises to remove its share of what the best leaves."""
    base, best, library = tried[frozenset()], ranked[0], case.system.effects
    size, always, offers = len(best.effects) + 1, [], []
    for parent in ranked[:_PARENTS]:
        fresh = [e for e in library if e not in parent.effects]
        for promise in score(with_derivatives(parent).fitted, fresh, workers).singles():
            gain = best.fitted.cost - parent.fitted.cost + promise.gain
            offers.append(promise._replace(gain=gain, suspected=parent is best and promise.effect in case.suspected))
            if offers[-1].suspected or (parent is best and library[promise.effect].apart):
                always.append(offers[-1])
    for one, other in combinations(ranked[:_JOINED], 2):
        if len({*one.effects, *other.effects}) == size:
            gain = base.fitted.cost - max(one.fitted.cost, other.fitted.cost)
            always.append(joined(one.fitted, other.fitted, gain))
    offers.sort(key=lambda one: -one.gain)
    left = max(best.fitted.cost - 0.5 * best.pieces_fitted, 0.0)
    if max((one.gain for one in (*offers, *always)), default=0.0) < case.policy.promising * left:
        return []
    chosen: dict[frozenset[str], Promise] = {}
    for promise in (*offers[: _RACED[size]], *always):
        same = frozenset(promise.problem.structure.effects)
        if same not in tried:
            chosen.setdefault(same, promise)
    return sorted(chosen.values(), key=lambda one: -one.gain)


def with_derivatives(candidate: Candidate) -> Candidate:
    """The candidate with derivatives, computed if it has none because it was only reweighed without iterations."""
    if candidate.fitted.solution.sensitivities:
        return candidate
    fitted = reweigh(candidate.fitted, candidate.fitted.problem.floor, max_iterations=_REWEIGHED_ITERATIONS)
    return Candidate(fitted, candidate.checked, candidate.policy)


def escape_local_optimum(base: Candidate, singles: Sequence[Candidate], split: Split) -> Candidate | None:
    """The base model refitted from the single-effect fit at whose parameters it costs least, if that explains more than
    `base` does: part of what the effects seemed to explain was then due to the base fit's local optimum."""
    problem = base.fitted.problem
    costs: dict[Candidate, float] = {}
    for one in singles:
        start = problem.start(base.fitted.structure.start(one.fitted.theta), one.fitted.solution.point.nuisances)
        costs[one] = cost_of(problem, start)
    nearest = min(costs, key=costs.__getitem__, default=None)
    if nearest is None or costs[nearest] > NEAR * base.fitted.cost:
        return None
    better = refitted_without(nearest, (), split)
    return better if base.cost - better.cost > max(base.policy.promising * base.excess, _MIN_GAIN) else None


def reweighed(candidate: Candidate, split: Split, floor: NoiseFloor, *, thoroughly: bool = True) -> Candidate:
    """The explanation against another floor; `thoroughly`: refitted from its current point, not just re-evaluated."""
    steps = _REWEIGHED_ITERATIONS if thoroughly else 0
    fitted = reweigh(candidate.fitted, floor, max_iterations=steps)
    return judge(fitted, split, candidate.policy, near=candidate.checked)
