"""Run one set through the engine's public interface and the peers; the seal is opened afterwards."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import lacuna
from benchmarks.cost import SimulationCount
from benchmarks.search_record import searched
from benchmarks.small.draw import Sealed
from benchmarks.small.offered import Offered
from benchmarks.small.peers import PEERS, problem
from lacuna import Record

Predict = Callable[[Record], np.ndarray]


def diagnosed(offered: Offered) -> tuple[dict[str, Any], dict[str, Any], Predict | None]:
    """The engine's verdict on a set, its search record, and the completed model. If the engine raises, the verdict is
    "crash"."""
    simulations = SimulationCount()
    system = offered.system(simulations.of(offered.model))
    began = time.process_time()
    try:
        verdict = lacuna.diagnose(system, offered.tables, progress=False)
    except Exception as error:  # whatever it is, the trial continues and counts it
        said = {"verdict": "crash", "effects": [], "crash": f"{type(error).__name__}: {error}"[:300]}
        return said | _cost(began, simulations), {}, None
    spent = _cost(began, simulations)
    said = {name: verdict.record[name] for name in ("verdict", "effects", "error", "warnings")}
    remainder = verdict.record["remainder"]
    said["remainder"] = {name: remainder[name] for name in ("matters", "share_of_gap", "times_floor")}
    found = searched(verdict.diagnosis, spent["simulations"])
    return said | spent, found, lambda record: np.asarray(verdict.model(record)[offered.kind.output])


def _cost(began: float, simulations: SimulationCount) -> dict[str, Any]:
    return {"processor_seconds": time.process_time() - began, "simulations": simulations.count}


def asked(offered: Offered, sealed: Sealed) -> dict[str, dict[str, Any]]:
    """What each peer names, its prediction error, and its cost; without peers that do not apply."""
    given, found = problem(offered), {}
    for name, solve in PEERS.items():
        if name.startswith("sparse") and given.terms is None:
            continue
        began = time.process_time()
        try:
            answer = solve(given)
            named, off = answer.named, predicted_off(offered, sealed, answer.predict)
        except (ValueError, ArithmeticError, np.linalg.LinAlgError):  # no model of its path can be simulated
            named, off = ("failed",), None  # which is wrong even if there was nothing to name
        named = None if named is None else list(named)
        found[name] = {"named": named, "off": off, "processor_seconds": time.process_time() - began}
    return found


def predicted_off(offered: Offered, sealed: Sealed, predict: Predict) -> float | None:
    """RMS error of predictions under conditions that nobody was given, against the noiseless truth, in noises; None if
    there is no prediction."""
    squares = []
    for run in sealed.judged:
        record = offered.record(run.name, run.name, run.time_s, run.applied, np.full(len(run.time_s), np.nan))
        squares.append(np.mean((predict(record) - run.clean) ** 2))
    off = float(np.sqrt(np.mean(squares)) / sealed.instrument.noise)
    return off if np.isfinite(off) else None


def opened(offered: Offered, sealed: Sealed) -> dict[str, Any]:
    """The contents of the seal, for the record."""
    instrument = sealed.instrument
    faults = {name: getattr(instrument, name) for name in ("colored", "rounds", "drifts", "gaps", "uneven")}
    return {
        "system": offered.kind.key,
        "truth": sorted(sealed.effects),
        "on_offer": sorted(sealed.offered),
        "formulas": list(sealed.formulas),
        "candidates": [e.name for e in offered.effects],
        "repeats": sealed.repeats,
        "noise": instrument.noise,
        "instrument": {name: value for name, value in faults.items() if value},
    }
