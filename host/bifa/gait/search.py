"""From a model to a gait: explore, refine, verify the finalists, say how sure it is."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bifa.errors import BifaError
from bifa.gait.methods import METHODS, Found
from bifa.gait.methods.cma_es import climb
from bifa.gait.methods.common import Recorder
from bifa.gait.metric import Metric, Passage
from bifa.gait.objectives import QUANTILE, NominalSpeed, RobustSpeed, distribution
from bifa.gait.simulations import Simulations
from bifa.gait.space import SearchSpace, paper_space
from bifa.gait.uncertainty import Spread, spread_of
from bifa.robot.gait import Gait
from bifa.robot.model import Model
from bifa.simulate import gait_rows, plant

# (stage, share of the stage that is done, best value so far in mm/s) -> None
OnProgress = Callable[[str, float, float], None]

DRAWS = 40  # robots that each gait meets in a robust search
VERIFYING_DRAWS = 512  # that the chosen one meets, all new
_SHORTLIST_DRAWS = 192
_SHORTLIST_QUANTILE = 0.075  # a margin for what 192 draws leave uncertain
_NOMINAL_FINALISTS, _ROBUST_FINALISTS = 60, 48
_REFINE_STEP = 0.015  # of the unit cube
_REFINE_SHARE = 0.33  # of the evaluations, in addition
EVALUATIONS = {"nominal": {"de": 4000, "cma": 4000, "bo": 1000}, "robust": {"de": 1200, "cma": 1200, "bo": 1000}}


class SearchError(BifaError):
    """No usable gait was found; the text says what to change."""


@dataclass(frozen=True)
class Settings:
    """How to search. `evaluations` None: a number that suits the method. `spread` None: the model's covariance,
    or 2 % without one. `refine`: follow the method with a small CMA-ES run from its best points (the paper did not)."""

    method: str = "de"
    robust: bool = True
    seed: int = 0
    evaluations: int | None = None
    spread: float | None = None
    space: SearchSpace = field(default_factory=paper_space)
    metric: Metric | Passage = field(default_factory=Metric)
    refine: bool = True


@dataclass(frozen=True)
class Optimum:
    """The gait and what is known of it.

    nominal_mm_s: verified on the model itself, 20 cycles with a finer step. speeds_mm_s: (n,) on `VERIFYING_DRAWS`
    robots that the search never met; quantile_mm_s: their 10th percentile. explored: what the search evaluated.
    """

    gait: Gait
    nominal_mm_s: float
    quantile_mm_s: float
    speeds_mm_s: np.ndarray
    spread: Spread
    settings: Settings
    evaluations: int
    simulations: int
    explored: Found


def optimise(
    model: Model, runs: Simulations, settings: Settings | None = None, on_progress: OnProgress | None = None
) -> Optimum:
    """Find the gait that maximises the settled speed, of the model or robustly. Deterministic for a seed.

    Raises SearchError where no gait in the space walks by the metric's rules.
    """
    settings = settings or Settings()
    if settings.method not in METHODS:
        raise SearchError(f"method {settings.method!r} is not one of {', '.join(METHODS)}")
    say = on_progress or (lambda stage, share, best: None)
    started = runs.count
    flat, spread = plant(model), spread_of(model, settings.spread)
    if settings.robust:
        draws = spread.plants(model, DRAWS, settings.seed)
        objective = RobustSpeed(runs, flat, draws, settings.space, settings.metric.quicker())
    else:
        objective = NominalSpeed(runs, flat, settings.space, settings.metric)
    explored = _explore(objective, settings, say)
    if explored.best_value <= 0.0:
        raise SearchError(
            f"none of {len(explored.values)} gaits walks without slipping; widen the space or search longer"
        )
    verify = _robustly if settings.robust else _nominally
    gait, nominal = verify(model, runs, spread, explored, settings, say)
    fresh = spread.plants(model, VERIFYING_DRAWS, settings.seed + 2_000_003)
    speeds = distribution(runs, fresh, gait_rows([gait]), settings.metric)[0]
    say("verify", 1.0, nominal)
    return Optimum(
        gait,
        nominal,
        float(np.quantile(speeds, QUANTILE)),
        speeds,
        spread,
        settings,
        len(explored.values),
        runs.count - started,
        explored,
    )


def _explore(objective, settings: Settings, say: OnProgress) -> Found:
    budget = settings.evaluations or EVALUATIONS["robust" if settings.robust else "nominal"][settings.method]
    wraps = settings.space.wraps
    found = METHODS[settings.method](
        objective, wraps, budget, settings.seed, lambda count, best: say("search", min(count / budget, 1.0), best)
    )
    if not settings.refine or found.best_value <= 0.0:
        return found
    share = round(_REFINE_SHARE * budget)
    recorder = Recorder(
        objective, wraps, lambda count, best: say("refine", min(count / share, 1.0), max(best, found.best_value))
    )
    climb(recorder, found.best_point, _REFINE_STEP, share, settings.seed, population=12)
    refined = recorder.found()
    return Found(np.concatenate([found.points, refined.points]), np.concatenate([found.values, refined.values]))


def _nominally(model, runs, spread, explored, settings, say) -> tuple[Gait, float]:
    """The fastest of the finalists by the finer metric. Many fail: the fastest gaits live at a cliff."""
    rows = gait_rows(settings.space.gaits(explored.finalists(_NOMINAL_FINALISTS, apart=0.003)))
    speeds = _finely(model, runs, rows, settings)
    say("verify", 0.5, float(speeds.max()))
    return _best(rows, speeds)


def _robustly(model, runs, spread, explored, settings, say) -> tuple[Gait, float]:
    """The best of the finalists over robots that the search did not meet, if the finer metric passes it.

    The finalists lie apart: what the search likes best may owe it to the few robots that the search met.
    """
    points = explored.finalists(_ROBUST_FINALISTS, apart=0.015)
    fresh = spread.plants(model, _SHORTLIST_DRAWS, settings.seed + 1_000_003)
    objective = RobustSpeed(runs, plant(model), fresh, settings.space, settings.metric, _SHORTLIST_QUANTILE)
    values = np.concatenate([objective(part) for part in np.array_split(points, max(1, len(points) // 8))])
    say("verify", 0.6, float(values.max()))
    order = np.argsort(-values, kind="stable")[:8]
    rows = gait_rows(settings.space.gaits(points[order]))
    stands = np.flatnonzero((_finely(model, runs, rows, settings) > 0.0) & (values[order] > 0.0))
    if not stands.size:
        raise SearchError("no finalist stands a finer step and 20 cycles; search longer")
    row = rows[stands[:1]]
    return Gait(*row[0].tolist()), float(_finely(model, runs, row, settings)[0])


def _finely(model, runs, rows: np.ndarray, settings: Settings) -> np.ndarray:
    which = np.zeros(len(rows), dtype=np.int64)
    return runs.judged([plant(model)], which, rows, settings.metric.finer()).counted_mm_s


def _best(rows: np.ndarray, speeds: np.ndarray) -> tuple[Gait, float]:
    best = int(np.argmax(speeds))
    if speeds[best] <= 0.0:
        raise SearchError("no finalist stands a finer step and 20 cycles; search longer")
    return Gait(*rows[best].tolist()), float(speeds[best])
