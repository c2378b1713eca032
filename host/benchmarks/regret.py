"""Regret of gait searches against the best known gait, by robot and seed.

    python -m benchmarks.regret [--robots 60] [--seeds 5] [--long 5] [--fully 60] [--models DIR]
                               [--records FILE] [--earlier FILE] [--print]

Robots: the nominal one and the strong push, then specimens (5 % in every parameter) with each effect of the library at
its usual size in turn, every tenth in a vertical pipe and every tenth before the tunnel; and every model-last.toml
below DIR, the completed models of campaigns, whose robust searches are at the edge of what is known of them. Robust
gaits are judged on robots that are the same for all searches, since the percentile that a search reports of its own may
be off by 3 % where it falls steeply. The best known gait of a robot is the best of all its runs: of every seed, of
`--long` searches with five times the budget, and of the peers (differential evolution, SciPy's DIRECT and SHGO) with as
many evaluations as the search took on average.
(nevergrad's NGOpt is not among them: 1.0.12 pins a bayesian-optimization older than `bo` needs.) Robust searches and
peers take ten times as long as nominal searches: `--fully` sets on how many of the robots, evenly spread, they are
run. FILE has one line per robot, with which a run resumes that was interrupted, had fewer seeds or searched fewer
robots fully. The speeds in the FILE of an earlier search count among the best known in place of long runs and peers.
"""

import argparse
import contextlib
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np
from scipy.optimize import direct, shgo

from benchmarks import records as lines
from bifa import effects
from bifa.gait import Optimum, SearchError, Settings, optimize, simulations
from bifa.gait.library.scenarios import SCENARIOS
from bifa.gait.objectives import NominalSpeed, distribution
from bifa.gait.pool import Simulations
from bifa.gait.search import EVALUATIONS
from bifa.gait.uncertainty import SPREAD, spread_of
from bifa.robot import BASE_PARAMETERS, Model, load_model, nominal, strong_push
from bifa.simulate import gait_rows, plant

ROBOTS, SEEDS, LONG, ALLOWED = 60, 5, 5, 0.01
_LONGER = 5
_SPECIMEN = 0.05
_JUDGED = 60
_COMMON, _COMMON_SEED = 4096, 9_000_000  # robots that robust gaits are judged on, and no search draws


def robots(count: int, models: Path | None = None) -> Iterator[tuple[str, Model, Settings]]:
    """Name, model and search settings of each robot."""
    if models:
        for file in sorted(models.rglob("model-last.toml")):
            yield file.parent.relative_to(models).as_posix(), load_model(file), Settings(at_edge=True)
    names = sorted(effects.library())
    for k in range(count):
        if k < 2:
            yield (("nominal", nominal(), Settings()), ("strong push", strong_push(), Settings()))[k]
            continue
        effect = names[(k - 2) % len(names)]
        place = {8: "vertical", 9: "obstacle"}.get(k % 10, "")
        settings = SCENARIOS[place].settings if place else Settings()
        yield f"{k} {effect} {place}".strip(), specimen(k).with_effects({effect: {}}), settings


def specimen(seed: int) -> Model:
    """A specimen of the nominal robot."""
    factors = 1.0 + _SPECIMEN * np.random.default_rng([seed, 44]).standard_normal(len(BASE_PARAMETERS))
    values = {n: nominal()[n] * f for n, f in zip(BASE_PARAMETERS, factors, strict=True)}
    values["mu_k"] = min(values["mu_k"], values["mu_s"])
    return nominal().with_values(values)


def searched(
    record: dict[str, Any],
    model: Model,
    settings: Settings,
    seeds: Sequence[int],
    long: int,
    runs: Simulations,
    fully: bool = True,
) -> dict[str, Any]:
    """Complete `record`: speeds of each seed, nominal and robust, of the long runs and of the peers; processor seconds
    per search, and the mean number of evaluations of the first nominal ones, which is also the peers' budget. Not
    `fully`: only the nominal searches.
    """
    record, spread = dict(record), None if model.covariance else SPREAD
    for kind, robust in (("nominal", False), ("robust", True))[: 1 + fully]:
        done = record.get(kind, [])
        if left := seeds[len(done) :]:
            own = [_found(model, replace(settings, robust=robust, seed=seed, spread=spread), runs) for seed in left]
            spent_s = sum(one.processor_s for one in own) + len(done) * record.get(f"{kind}_s", 0.0)
            record[kind] = [*done, *(one.speed_mm_s for one in own)]
            record[f"{kind}_s"] = spent_s / len(seeds)
            record.setdefault("evaluations", round(mean(one.evaluations for one in own)) or EVALUATIONS["cma"])
        if f"{kind}_long" not in record:
            more = replace(settings, robust=robust, evaluations=_LONGER * EVALUATIONS["cma"], spread=spread)
            record[f"{kind}_long"] = [_found(model, replace(more, seed=1000 + k), runs).speed_mm_s for k in range(long)]
    budget = record["evaluations"]
    if fully and "de" not in record:
        peer_settings = replace(settings, robust=False, method="de", evaluations=budget)
        record["de"] = _found(model, peer_settings, runs).speed_mm_s
    for name, minimize in PEERS.items():
        if fully and name not in record:
            record[name] = peer(minimize, model, settings, budget, runs)
    return record


def known_before(record: dict[str, Any]) -> dict[str, Any]:
    """Begin the record of a robot that an earlier search has a `record` of: whatever that found is known."""
    known = {f"{kind}_long": record[kind] + record[f"{kind}_long"] for kind in ("nominal", "robust") if kind in record}
    return {name: record[name] for name in ("robot", "evaluations", "de", *PEERS) if name in record} | known


@dataclass(frozen=True)
class _Found:
    speed_mm_s: float
    evaluations: int
    processor_s: float


def _found(model: Model, settings: Settings, runs: Simulations) -> _Found:
    start = time.process_time()
    try:
        found = optimize(model, runs, settings)
    except SearchError:
        return _Found(0.0, 0, time.process_time() - start)
    spent_s = time.process_time() - start
    return _Found(judged(found, model, runs) if settings.robust else found.nominal_mm_s, found.evaluations, spent_s)


def judged(found: Optimum, model: Model, runs: Simulations) -> float:
    """What the search maximised, on robots that are the same for all searches for `model`."""
    metric = found.settings.metric.with_tolerance(found.settings.fine_m)
    speeds = distribution(runs, found.spread.plants(model, _COMMON, _COMMON_SEED), gait_rows([found.gait]), metric)[0]
    return found.settings.low_mm_s(speeds, found.settings.share)


PEERS: dict[str, Callable[..., object]] = {
    "direct": lambda speed, box, budget: direct(speed, box, maxfun=budget, maxiter=budget),
    "shgo": lambda speed, box, budget: shgo(speed, box, n=budget // 4, sampling_method="sobol"),
}


class _SpentError(Exception):
    """The budget is spent."""


def peer(minimize: Callable[..., object], model: Model, settings: Settings, budget: int, runs: Simulations) -> float:
    """Run one of SciPy's optimizers on the search's own objective, for `budget` evaluations; as in the search, the best
    of the gaits tried are judged again by the finer metric."""
    metric = settings.metric_for(model, spread_of(model, settings.spread))
    speed = NominalSpeed(runs, plant(model), settings.space, metric)
    tried: list[tuple[float, np.ndarray]] = []

    def slowness(point: np.ndarray) -> float:
        if len(tried) >= budget:
            raise _SpentError
        tried.append((float(speed(point[None])[0]), np.array(point)))
        return -tried[-1][0]

    with contextlib.suppress(_SpentError):
        minimize(slowness, [(0.0, 1.0)] * len(settings.space.axes), budget)
    best = np.array([point for _, point in sorted(tried, key=lambda one: -one[0])[:_JUDGED]])
    return float(NominalSpeed(runs, plant(model), settings.space, metric.finer())(best).max())


def regrets(record: dict) -> list[float]:
    """For every seed, nominal and robust, the share by which it is slower than the best known."""
    found = []
    for kind in (kind for kind in ("nominal", "robust") if kind in record):
        best = _best_known(record, kind)
        found += [0.0 if best <= 0.0 else 1.0 - speed / best for speed in record[kind]]
    return found


def _best_known(record: dict, kind: str) -> float:
    peers = [record[name] for name in ("de", *PEERS) if name in record] if kind == "nominal" else []
    return max([*record[kind], *record[f"{kind}_long"], *peers])


def row(name: str, record: dict) -> str:
    """A line of the table: the worst of the seeds and the best known, nominal and robust; the peers."""
    text = f"{name:34}"
    for kind in ("nominal", "robust"):
        if kind not in record:
            text += 25 * " "
            continue
        best = _best_known(record, kind)
        text += f"{min(record[kind]):9.2f}{best:9.2f}{record[f'{kind}_s']:7.1f}"
    peers = "".join(f"{record[name]:9.2f}" if name in record else 9 * " " for name in ("de", *PEERS))
    return text + f"{record['evaluations']:8}{peers}{100 * max(regrets(record)):9.2f}"


HEADING = (
    f"{'':34}{'nominal, mm/s':>18}{'s':>7}{'robust, mm/s':>18}{'s':>7}{'peers, nominal':>35}{'worst':>9}\n"
    f"{'robot':34}"
    + f"{'worst':>9}{'best':>9}{'':7}" * 2
    + f"{'budget':>8}{'DE':>9}{'DIRECT':>9}{'SHGO':>9}{'regret %':>9}"
)


def run(
    count: int,
    seeds: int,
    long: int,
    models: Path | None = None,
    kept: Path | None = None,
    every: int | None = None,
    earlier: Path | None = None,
) -> dict[str, float]:
    """Print the table, a line as each robot ends; return the figures flat. Ctrl-C ends with a summary of those done.
    `every`: how many of the robots are searched fully; None: all. `earlier`: records of an earlier search."""
    known = lines.read(kept, "robot")
    before = {name: known_before(record) for name, record in lines.read(earlier, "robot").items()}
    print(HEADING)
    found: list[dict] = []
    asked = list(robots(count, models))
    every = len(asked) if every is None else every
    try:
        with simulations() as runs:
            for number, (name, model, settings) in enumerate(asked):
                record = known.setdefault(name, before.get(name, {"robot": name}))
                fully = number * every // len(asked) > (number - 1) * every // len(asked)
                known[name] = searched(record, model, settings, range(seeds), long, runs, fully)
                if kept and known[name] != record:
                    lines.write(kept, known.values())
                found.append(known[name])
                print(row(name, known[name]), flush=True)
    except KeyboardInterrupt:
        print(f"\ninterrupted after {len(found)} robots; the same command resumes")
    return summed_up(found) if found else {}


def summed_up(found: Sequence[dict]) -> dict[str, float]:
    """Print the worst regret and the share of searches over one per cent; return the figures."""
    every = [regret for record in found for regret in regrets(record)]
    worst, share = max(every), mean(regret > ALLOWED for regret in every)
    print(
        f"regret over {len(every)} searches of {len(found)} robots: worst {100 * worst:.2f} %, "
        f"over 1 %: {100 * share:.1f} %"
    )
    return {"gait_regret_worst": worst, "gait_regret_share_over_1_percent": share, "gait_regret_robots": len(found)}


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.regret", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, default=ROBOTS)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--long", type=int, default=LONG, help="searches of each kind with five times the budget")
    parser.add_argument("--fully", type=int, help="number of robots with robust searches and peers; default: all")
    parser.add_argument("--models", type=Path, help="folder whose model-last.toml files are searched as well")
    parser.add_argument("--records", type=Path, help="one line of JSON per robot; read first, then kept up to date")
    parser.add_argument("--earlier", type=Path, help="records of an earlier search, whose speeds count among the known")
    parser.add_argument("--print", action="store_true", help="only print what is in the records")
    options = parser.parse_args()
    if options.print and options.records is None:
        parser.error("--print needs the records to print: add --records FILE")
    if options.print:
        found = list(lines.read(options.records, "robot").values())
        print("\n".join([HEADING, *(row(one["robot"], one) for one in found)]))
        summed_up(found)
        return
    kept, earlier = options.records, options.earlier
    run(options.robots, options.seeds, options.long, options.models, kept, options.fully, earlier)


if __name__ == "__main__":
    main()
