"""The search for a gait on a model: explore, refine, verify the finalists, report how certain the result is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bifa.errors import BifaError
from bifa.gait.families import FAMILIES, PERIODS
from bifa.gait.methods import METHODS, Evaluated
from bifa.gait.methods.cma_es import (
    BASIN_SPACING,
    NEAR_TOP,
    PATIENCE,
    POPULATION,
    Patience,
    basins,
    climb_basins,
    climb_together,
)
from bifa.gait.methods.common import Ends, Objective, OnEvaluated, RecordedObjective
from bifa.gait.metric import Metric, Passage
from bifa.gait.objectives import QUANTILE, NominalSpeed, RobustSpeed, as_walked, distribution, mean_of_walking, on_model
from bifa.gait.pool import Simulations
from bifa.gait.prediction import CYCLES, FINE_M, MIN_SPEED_RATIO, Prediction, predict_speed, settles
from bifa.gait.settling import STANDING_MM_S
from bifa.gait.space import TIMES, SearchSpace, paper_space
from bifa.gait.uncertainty import Knowledge, spread_of
from bifa.robot.gait import Gait
from bifa.robot.model import Model
from bifa.simulate import Plant, gait_rows, plant

# (stage, share of the stage that is done, best value so far in mm/s) -> None
OnProgress = Callable[[str, float, float], None]

VERIFYING_DRAWS = 1024  # robots, none used in the search, on which the chosen gait is evaluated
_NOMINAL_FINALISTS, _ROBUST_FINALISTS = 60, 4
_SLOWED = 15  # nominal finalists of which slower copies are tried
# Default budgets. That of cma is an upper limit, for landscapes with many basins: it stops once its best runs agree.
# Robust searches get a quarter, because the gaits fastest on the model are only their starting points.
EVALUATIONS = {"cma": 8000, "de": 4000, "bo": 1000}


@dataclass(frozen=True)
class RobustRound:
    """One round of a robust search.

    draws: robots that each gait is evaluated on. quantile: of the speed, maximised. abandon: share of the best value
    below which a gait is abandoned. tolerance_m: of the integrator, per step. periods: relative changes of the period
    that the previous round's gaits are tried with. evaluations, step, climbs: budget, initial step and number of the
    CMA-ES runs; trial: generations after which those below `abandon` of the best are abandoned; stall: generations
    without a gain after which a run ends. jitter: relative variation of the period from robot to robot. typical: robots
    by whose mean speed, with the model's own, gaits at the edge are ranked.
    """

    draws: int
    quantile: float
    abandon: float
    tolerance_m: float
    periods: tuple[float, ...] = (0.0,)
    evaluations: int = 0
    step: float = 0.0
    climbs: int = 1
    trial: int = PATIENCE.trial
    stall: int = PATIENCE.stall
    jitter: float = 0.0
    typical: int = 0

    @property
    def patience(self) -> Patience:
        """When a CMA-ES run of the round ends before its budget."""
        return Patience(self.trial, self.abandon, self.stall)


# Few robots while gaits differ widely, many once they hardly differ. The quantiles are below 10 %: a gait tuned until
# one in ten of its own robots fails would fail more often on others.
EXPLORE = RobustRound(24, 0.08, 0.95, 1e-5, (0.0, 0.02, 0.04, 0.08, 0.16), 1000, 0.06, jitter=0.005, typical=3)
# At the cliff tiny changes of the period decide. Few robots favour periods that are too short, and so do integration
# errors: with one gait 99 % of the robots walked at steps of 30 um, 65 % at 10 um, 34 % at 3 um, 27 % at 1 um and less.
_REFINE = RobustRound(
    128, 0.0677, 0.98, 3e-6, (0.0, 0.01, 0.02, 0.04, -0.01), 400, 0.006, 3, trial=6, stall=3, jitter=0.002, typical=8
)
# Changes, in s, of a gait's times that are tried between climbs: a climb ends at the first of many local optima.
_LONGER_S: dict[str, tuple[float, ...]] = {name: (-0.1, -0.04, 0.04, 0.1) for name in TIMES}
_LONGER_S |= {"body_vacuum": (-0.12, -0.06, -0.03, 0.03, 0.06), "body_pressure": (-0.02, 0.02, 0.05, 0.1)}
_CHANGES = sum(map(len, _LONGER_S.values()))
# The last few thousandths: finalists differ less than 128 robots can tell.
_FINISH = RobustRound(256, 0.08, 0.997, 3e-6, (0.0, 0.004, -0.004), 48, 0.002, jitter=0.001, typical=16)
# Finalists are checked by the full metric: the quick one is lenient, and a gait that is best on some robots may fail
# on others. Copies slower by these fractions follow.
_CHECKING_DRAWS, _CHECK_QUANTILE = 512, 0.085
_SLOWER = (0.005, 0.01, 0.02, 0.05)
_BASINS, _STARTS = 24, 8  # explored gaits where climbs on robots start; those to refine if there were no climbs
_MIN_SPACING, _WIDE_SPACING = 0.003, 0.02  # minimum distance between finalists, on some axis of the unit cube
_RIDGE_SPACING = 0.04  # between the starts of the second round: several along one ridge, which short runs do not follow
# Climbs on robots: how many families to start from, and the shares of the best value that these, and the end points of
# the previous round, must reach.
_FAMILIES, _MIN_FAMILY_RATIO, _MIN_END_RATIO = 3, 0.9, 0.95
_FAMILY_CLIMBS = 1000  # evaluations of these on the model itself
# Shares of the best value that a gait must keep in the check: to be accepted at once, and to count as walking.
_ACCEPT_RATIO, _WALK_RATIO = 0.993, 0.5
_NO_FINALIST = "no candidate survives re-simulation over 20 cycles with a finer step; search longer"
_EDGE_M = 1e-7  # integrator's tolerance at the edge, where ways of walking part that a parameter's error moves less
_EDGE_QUANTILE = 0.05  # share of the robots that need not walk with a gait at the edge
# Refinement on the model itself: a large population, since along a ragged ridge a small one ends at the first spike.
_FINAL_STEP, _FINAL, _FINAL_POPULATION = 0.03, 2400, 48


class SearchError(BifaError):
    """No usable gait was found; the message says what to change."""


@dataclass(frozen=True)
class Settings:
    """Settings of a search.

    evaluations: None for the method's default. spread: relative; None for what is known of the model, or 2 % if nothing
    was fitted. naive: draw robots from the covariance alone. at_edge: maximise the mean speed among gaits with which
    19 in 20 robots walk, instead of the speed that 9 in 10 reach. refine: follow the method with short CMA-ES
    runs from its best points (the paper did not). begin: gaits that are known to walk; the search also starts from
    them, and drawn robots that do not walk with them are discarded.
    """

    method: str = "cma"
    robust: bool = True
    seed: int = 0
    evaluations: int | None = None
    spread: float | None = None
    space: SearchSpace = field(default_factory=paper_space)
    metric: Metric | Passage = field(default_factory=Metric)
    refine: bool = True
    naive: bool = False
    at_edge: bool = False
    begin: tuple[Gait, ...] = ()

    @property
    def share(self) -> float:
        """Share of the robots that may be slower than the speed that a robust search maximises."""
        return _EDGE_QUANTILE if self.at_edge else QUANTILE

    @property
    def aim(self) -> str:
        """What the search maximises, in words."""
        if not self.robust:
            return "speed on the model itself"
        walking = f"mean speed of the robots that walk, if {100 - 100 * self.share:g} % do"
        return walking if self.at_edge else f"{100 * self.share:g}th percentile of the speed"

    @property
    def rules(self) -> Metric | Passage:
        """The metric that applies: a robust search judges the model itself by the rules for drawn robots."""
        return self.metric.of_draws() if self.robust else self.metric

    def metric_for(self, model: Model, known: Knowledge) -> Metric | Passage:
        """The metric as the model needs it: with its timekeeping, and over whole walks if none of its walks settles."""
        metric = replace(self.metric, timing=known.scatter.timing)
        return metric if settles(model) else metric.of_unlike_cycles()

    @property
    def fine_m(self) -> float:
        """Tolerance of the integrator, per step, when gaits are compared with one another and verified."""
        return _EDGE_M if self.at_edge else FINE_M

    def low_mm_s(self, speeds_mm_s: np.ndarray, share: float) -> float:
        """Return the quantile `share` of drawn robots' speeds (n,) as this search counts them."""
        counted = as_walked(speeds_mm_s, mean_of_walking(speeds_mm_s)) if self.at_edge else speeds_mm_s
        return float(np.quantile(counted, share))


@dataclass(frozen=True)
class Optimum:
    """The best gait found, with its predicted performance.

    nominal_mm_s: speed on the model itself, verified over 20 cycles with a finer step. speeds_mm_s: (n,) speeds on
    `VERIFYING_DRAWS` robots that the search never used; quantile_mm_s: what was maximised of them, see `Settings.aim`.
    evaluations: gaits that were tried before the finalists. explored: everything that the first round evaluated.
    prediction: of a walk with the gait.
    """

    gait: Gait
    nominal_mm_s: float
    quantile_mm_s: float
    speeds_mm_s: np.ndarray
    spread: Knowledge
    settings: Settings
    evaluations: int
    simulations: int
    explored: Evaluated
    prediction: Prediction

    @property
    def percentile_10_mm_s(self) -> float:
        """The speed that nine in ten robots reach."""
        return float(np.quantile(self.speeds_mm_s, QUANTILE))

    @property
    def doubt(self) -> str:
        """A warning if the best two independent runs of the search ended at different speeds; otherwise empty."""
        if self.explored.ends is None or self.explored.agrees:
            return ""
        ends = self.explored.ends.values
        first, second = (*ends, 0.0)[:2]
        return (
            f"the search has not converged: its best two of {len(ends)} runs ended at {first:.2f} and "
            f"{second:.2f} mm/s, so a faster gait may exist; search longer with --evaluations, or try another --seed"
        )


@dataclass(frozen=True)
class SearchRun:
    """A search in progress: the model, what is `known` of it, and the progress callback."""

    model: Model
    runs: Simulations
    known: Knowledge
    settings: Settings
    on_progress: OnProgress = lambda stage, share, best: None

    def progress_callback(self, stage: str, budget: int, least: float = -np.inf) -> OnEvaluated:
        """Return a progress callback for a stage of `budget` evaluations; `least`: best value before the stage."""
        return lambda count, best: self.on_progress(stage, min(count / budget, 1.0), max(best, least))

    def objective(self, stage: RobustRound, number: int) -> RobustSpeed:
        """Return the objective of a round, on robots of its own."""
        settings = self.settings
        draws = self.robots(stage.draws, settings.seed + 500_000 * number)
        metric = settings.metric.with_tolerance(stage.tolerance_m)
        share = stage.quantile * settings.share / QUANTILE
        nominal, space = plant(self.model), settings.space
        rules = (share, stage.abandon, stage.jitter, stage.typical if settings.at_edge else 0, settings.fine_m)
        return RobustSpeed(self.runs, nominal, draws, space, metric, *rules)

    def robots(self, count: int, seed: int) -> list[Plant]:
        """Draw `count` robots that walk with `settings.begin`, gaits with which the real one is known to walk: the
        covariance does not contain that constraint. If fewer than half of the drawn robots meet it, the model does not
        contain it either and the draws are returned unfiltered; likewise if the spread is a guess."""
        drawn = self.known.plants(self.model, count, seed)
        if self.known.is_guess or not self.settings.begin:
            return drawn
        rows, metric = gait_rows(self.settings.begin), self.settings.metric.quicker()
        speeds = distribution(self.runs, drawn, rows, metric)
        least = MIN_SPEED_RATIO * np.median(speeds, axis=1, keepdims=True)
        if (speeds >= least).all():
            return drawn
        more = self.known.plants(self.model, 2 * count, seed)[count:]
        walk = np.hstack([speeds, distribution(self.runs, more, rows, metric)]) >= least
        walking = [robot for robot, walks in zip((*drawn, *more), walk.all(axis=0), strict=True) if walks]
        return walking[:count] if len(walking) >= count else drawn

    def verifying_robots(self) -> list[Plant]:
        """Draw the robots that `Optimum.speeds_mm_s` refers to."""
        return self.robots(VERIFYING_DRAWS, self.settings.seed + 2_000_003)

    def fine_speeds(self, rows: np.ndarray) -> np.ndarray:
        """Speeds (n,) of gaits (n, 6) on the model itself by the finer metric."""
        return on_model(self.runs, plant(self.model), rows, self.settings.rules.finer())


def optimize(
    model: Model, runs: Simulations, settings: Settings | None = None, on_progress: OnProgress | None = None
) -> Optimum:
    """Find the gait that maximises the settled speed, on the model itself or robustly. Deterministic for a given seed.

    Raises SearchError if no gait in the space walks by the metric's rules.
    """
    settings = settings or Settings()
    if settings.method not in METHODS:
        raise SearchError(f"method {settings.method!r} is not one of {', '.join(METHODS)}")
    started = runs.count
    known = spread_of(model, settings.spread)
    known = known.naive if settings.naive else known
    settings = replace(settings, metric=settings.metric_for(model, known))
    metric = settings.metric
    search = SearchRun(model, runs, known, settings, on_progress or SearchRun.on_progress)
    rules = settings.rules.quicker() if settings.robust else metric
    own = NominalSpeed(runs, plant(model), settings.space, rules)
    explored = _explore(search, own)
    tried = len(explored.values)
    if explored.best_value <= 0.0:
        how = "on the model itself" if settings.robust else "without slipping"
        raise SearchError(f"none of {tried} gaits walks {how}; widen the space or search longer")
    if settings.robust:
        explored = explore_on_robots(search, explored)
        tried += len(explored.values)
        if explored.best_value <= 0.0:
            none = f"none of {tried} gaits walks on enough of the drawn robots"
            raise SearchError(f"{none}; narrow their spread, or widen the space")
        refined = _refine_on_robots(search, explored) if settings.refine else []
        gait, nominal = best_of_finalists(search, explored, [explored, *refined][-1])
    else:
        refined = []
        if settings.refine:
            explored = _climb_families(search, own, explored)
            tried, refined = len(explored.values), [_refine(search, own, explored)]
        gait, nominal = _fastest_finalist(search, explored.joined(*refined))
    verifying, finest = search.verifying_robots(), metric.with_tolerance(settings.fine_m)
    speeds = distribution(runs, verifying, gait_rows([gait]), finest)[0]
    search.on_progress("verify", 1.0, nominal)
    return Optimum(
        gait,
        nominal,
        settings.low_mm_s(speeds, settings.share),
        speeds,
        known,
        settings,
        tried + sum(len(found.values) for found in refined),
        runs.count - started,
        explored,
        _predicted(search, gait, speeds),
    )


def _predicted(search: SearchRun, gait: Gait, speeds: np.ndarray) -> Prediction:
    """Predict by the rule for measured walks; for other metrics (up a pipe, through a tunnel) by the metric itself."""
    metric = search.settings.metric
    if not (isinstance(metric, Metric) and metric.is_plain):
        return Prediction(speeds, metric.cycles)
    cycles = max(CYCLES, metric.cycles)
    return predict_speed(search.model, search.known, gait, seed=search.settings.seed, cycles=cycles)


def _explore(search: SearchRun, objective: Objective) -> Evaluated:
    settings, space = search.settings, search.settings.space
    budget = _budget(settings)
    method = METHODS[settings.method]
    explored = method(objective, space.wraps, budget, settings.seed, search.progress_callback("search", budget))
    begun = space.nearest(settings.begin)
    return explored.joined(Evaluated(begun, objective(begun))) if len(begun) else explored


def explore_on_robots(search: SearchRun, explored: Evaluated) -> Evaluated:
    """Run CMA-ES on a few robots, from gait families, the basins of the nominal speed, and `settings.begin`. Slower
    copies are tried too: the nominally fastest gaits are beyond the cliff of most robots, where the objective is 0."""
    settings, space, wraps = search.settings, search.settings.space, search.settings.space.wraps
    starts = np.vstack([space.nearest(settings.begin), basins(explored, wraps, _BASINS)])
    copies = np.concatenate(_at_periods(space, starts, EXPLORE.periods))
    budget = len(copies)
    if settings.refine:
        budget += _tunings(len(FAMILIES), PERIODS) + _scaled_budget(EXPLORE.evaluations, settings)
    progress_callback = search.progress_callback("search on robots", budget)
    recorder = RecordedObjective(search.objective(EXPLORE, 0), wraps, progress_callback)
    recorder(copies)
    if not settings.refine:
        return recorder.found()
    known = list(_best_families(recorder, space))
    return climb_basins(recorder, wraps, budget, settings.seed, EXPLORE.step, known, EXPLORE.patience)


def _climb_families(search: SearchRun, objective: Objective, explored: Evaluated) -> Evaluated:
    """Climb from the best families, too: two batches of climbs may agree on a slower one."""
    settings, wraps = search.settings, search.settings.space.wraps
    climbs = _scaled_budget(_FAMILY_CLIMBS, settings)
    budget = _tunings(len(FAMILIES), PERIODS) + climbs
    progress_callback = search.progress_callback("families", budget, explored.best_value)
    recorder = RecordedObjective(objective, wraps, progress_callback)
    known = _best_families(recorder, settings.space)
    if not len(known):
        return explored.joined(recorder.found())
    ends = climb_together(recorder, known, climbs, settings.seed, [NEAR_TOP] * len(known))
    return explored.joined(recorder.found(ends))


def _best_families(recorder: RecordedObjective, space: SearchSpace) -> np.ndarray:
    """The best families (n, dimensions), each with the period and the times that suit the robot; none if none walks."""
    tuned = _tune_times(recorder, space, space.nearest(FAMILIES), PERIODS)
    return tuned.near_best(_MIN_FAMILY_RATIO).finalists(_FAMILIES, _MIN_SPACING, space.wraps)


def _tune_times(objective: Objective, space: SearchSpace, points: np.ndarray, periods: Sequence[float]) -> Evaluated:
    """Improve each point (n, dimensions): take the best of the period changes, then the best change of one time."""
    tried = _at_periods(space, points, periods)
    # One call each: gaits worse than the best so far are evaluated on few robots only.
    points = _best_copies(tried, [objective(one) for one in tried]).points
    retimed = [space.retimed(points, {name: by}) for name, each in _LONGER_S.items() for by in each]
    values = objective(np.concatenate([points, *retimed]))
    return _best_copies([points, *retimed], np.split(values, 1 + len(retimed)))


def _tunings(points: int, periods: Sequence[float]) -> int:
    """Evaluations that `_tune_times` takes for so many points."""
    return points * (len(periods) + 1 + _CHANGES)


def _best_copies(copies: Sequence[np.ndarray], values: Sequence[np.ndarray]) -> Evaluated:
    """Select the best copy of each point; `copies` are (n, dimensions) each, their `values` (n,) each."""
    best, every = np.argmax(values, axis=0), np.arange(len(copies[0]))
    return Evaluated(np.array(copies)[best, every], np.array(values)[best, every])


def _budget(settings: Settings) -> int:
    return settings.evaluations or _default_budget(settings)


def _default_budget(settings: Settings) -> int:
    return EVALUATIONS[settings.method] // (4 if settings.robust else 1)


def _scaled_budget(evaluations: int, settings: Settings) -> int:
    """Scale `evaluations` by the ratio of the chosen budget to the default one."""
    return max(2 * POPULATION, round(evaluations * _budget(settings) / _default_budget(settings)))


def _refine(search: SearchRun, objective: Objective, explored: Evaluated) -> Evaluated:
    """Run CMA-ES from the best explored point."""
    settings = search.settings
    budget = _scaled_budget(_FINAL, settings)
    progress_callback = search.progress_callback("refine", budget, explored.best_value)
    recorder = RecordedObjective(objective, settings.space.wraps, progress_callback)
    begun, wraps = explored.best_point[None], settings.space.wraps
    shapes = explored.shapes_near(begun, wraps)
    climb_together(recorder, begun, budget, settings.seed, [_FINAL_STEP], shapes=shapes, population=_FINAL_POPULATION)
    return recorder.found()


def _refine_on_robots(search: SearchRun, explored: Evaluated) -> list[Evaluated]:
    """Run CMA-ES on many robots from the best end points of the climbs on few, ranked again on the new robots: the best
    on few robots may be so by chance. Returns nothing if none of these points walks on them."""
    settings, wraps = search.settings, search.settings.space.wraps
    ended = explored.finalists(_STARTS, BASIN_SPACING, wraps) if explored.ends is None else explored.ends.points
    ended = np.vstack([settings.space.nearest(settings.begin), ended])
    budget = _tunings(len(ended), _REFINE.periods) + _scaled_budget(_REFINE.evaluations, settings)
    recorder = RecordedObjective(search.objective(_REFINE, 1), wraps, search.progress_callback("refine", budget))
    best = _tune_times(recorder, settings.space, ended, _REFINE.periods)
    begun = best.near_best(_MIN_END_RATIO).finalists(_REFINE.climbs, _RIDGE_SPACING, wraps)
    if not len(begun):
        return []
    return [recorder.found(_climb_on(search, _REFINE, recorder, begun, explored))]


def _climb_on(
    search: SearchRun, stage: RobustRound, recorder: RecordedObjective, begun: np.ndarray, before: Evaluated
) -> Ends:
    """Run CMA-ES from points `begun` (n, dimensions) with the covariances that the runs of the round `before` adapted
    nearby: a ridge along the cliff has nearly the same direction on other robots, and a short run cannot learn it."""
    wraps, settings = search.settings.space.wraps, search.settings
    budget, steps = _scaled_budget(stage.evaluations, settings), [stage.step] * len(begun)
    shapes, seed = before.shapes_near(begun, wraps), settings.seed
    return climb_together(recorder, begun, budget, seed, steps, stage.patience, shapes=shapes)


def _fastest_finalist(search: SearchRun, explored: Evaluated) -> tuple[Gait, float]:
    """Return the fastest finalist by the finer metric, with its speed. Many fail, because the fastest gaits are at a
    cliff; if none keeps `_ACCEPT_RATIO` of the best explored value, finalists further apart and then slower copies are
    tried."""
    space, rows, speeds = search.settings.space, np.empty((0, 6)), np.empty(0)
    near, far = (explored.finalists(_NOMINAL_FINALISTS, apart=apart) for apart in (_MIN_SPACING, _WIDE_SPACING))
    slower = np.concatenate([space.slower(points[:_SLOWED], share) for points in (near, far) for share in _SLOWER])
    for points in (near, far, slower):
        more = space.rows(points)
        rows, speeds = np.vstack([rows, more]), np.append(speeds, search.fine_speeds(more))
        search.on_progress("verify", 0.5, float(speeds.max()))
        if speeds.max() > _ACCEPT_RATIO * explored.best_value:
            break
    best = int(np.argmax(speeds))
    if speeds[best] <= 0.0:
        raise SearchError(_NO_FINALIST)
    return Gait(*rows[best].tolist()), float(speeds[best])


def best_of_finalists(search: SearchRun, explored: Evaluated, refined: Evaluated) -> tuple[Gait, float]:
    """Climb from the best finalist of `refined` on robots of a last round, and return the first finalist of this round
    that keeps `_ACCEPT_RATIO` of the best value on robots the search did not use, and its speed. Slower copies of the
    best one follow, in case all finalists are beyond the cliff. If none keeps that much, the best of those that keep
    `_WALK_RATIO` is taken, and failing that, the one with the highest mean speed."""
    settings, space = search.settings, search.settings.space
    finalists = refined.finalists(_ROBUST_FINALISTS, apart=_MIN_SPACING)
    copies = np.concatenate(_at_periods(space, finalists, _FINISH.periods))
    budget = len(copies) + _scaled_budget(_FINISH.evaluations, settings)
    recorder = RecordedObjective(search.objective(_FINISH, 2), space.wraps, search.progress_callback("finish", budget))
    # One call each: gaits worse than the best so far are evaluated on few robots only, the hardest first.
    for point in copies:
        recorder(point[None])
    if recorder.best < _WALK_RATIO * refined.best_value:  # all of them fall on these robots
        for point in np.concatenate(_at_periods(space, finalists, _SLOWER)):
            recorder(point[None])
    if settings.refine and recorder.best > 0.0:
        _climb_on(search, _FINISH, recorder, recorder.found().best_point[None], refined)
    best, promised = recorder.found().finalists(_ROBUST_FINALISTS, apart=_MIN_SPACING), recorder.best
    search.on_progress("verify", 0.6, promised)
    checking = search.robots(_CHECKING_DRAWS, settings.seed + 2_500_000)
    metric = settings.metric.with_tolerance(settings.fine_m)
    # Relative to the best value of the last round, not to the gait's speed on the model, where it may have failed too.
    least = max(_WALK_RATIO * promised, STANDING_MM_S)
    near = np.concatenate([best, *(space.slower(best[:1], share) for share in _SLOWER)])
    # Finalists from elsewhere, used only if none of the above walks at all by the full metric.
    far = explored.finalists(_NOMINAL_FINALISTS, apart=_WIDE_SPACING)
    otherwise, most = None, (False, -1.0)
    for candidates in (near, far):
        rows = space.rows(candidates)
        for row, speed in zip(rows, search.fine_speeds(rows), strict=True):
            if speed <= 0.0:
                continue
            speeds = distribution(search.runs, checking, row[None], metric)[0]
            low = settings.low_mm_s(speeds, _CHECK_QUANTILE * settings.share / QUANTILE)
            stands = low > least
            if stands and low >= _ACCEPT_RATIO * promised:
                return Gait(*row.tolist()), float(speed)
            if (worth := (stands, low if stands else float(speeds.mean()))) > most:
                otherwise, most = (Gait(*row.tolist()), float(speed)), worth
        if otherwise is not None:
            return otherwise
    raise SearchError(_NO_FINALIST)


def _at_periods(space: SearchSpace, points: np.ndarray, periods: Sequence[float]) -> list[np.ndarray]:
    """Copies of the points (n, dimensions), one array for each relative change of the period in `periods`."""
    return [space.slower(points, share) for share in periods]
