"""The comparison: every rival on every system, one block of rows per system."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.systems.lines import lines_of
from benchmarks.systems.problem import KnownProblem, RivalAnswer
from benchmarks.systems.rivals import best_subset, engine, gaussian_process, sparse_regression


@dataclass(frozen=True)
class Rival:
    """`lines` needed to call it, besides the model; `by_terms`: whether it also needs the model as a sum of terms."""

    key: str
    name: str
    solve: Callable[[KnownProblem], RivalAnswer]
    lines: int
    by_terms: bool = False


RIVALS = (
    Rival("lacuna", "lacuna", engine.solve, lines_of(engine)),
    Rival("best_subset", "best subset by BIC, SciPy", best_subset.solve, lines_of(best_subset)),
    Rival(
        "sparse_regression",
        "sparse regression, pysindy",
        sparse_regression.solve,
        lines_of(sparse_regression) + lines_of(best_subset, ("bic",)),
        by_terms=True,
    ),
    Rival(
        "gaussian_process",
        "model and Gaussian process",
        gaussian_process.solve,
        lines_of(gaussian_process) + lines_of(best_subset, ("fit", "STARTS")),
    ),
)


def compare(problem: KnownProblem) -> dict[str, float]:
    """Print a block of rows, the first one for the base model; return the figures flat."""
    for record in problem.fitted:  # compiles just-in-time code before timing
        problem.predict(record, {})
    there = " + ".join(sorted(problem.truth)) or "nothing that is on offer"
    samples = sum(len(r.time_s) for r in problem.fitted)
    print(f"\n{problem.name} ({problem.source})\nto be named: {there}, of {len(problem.effects)} candidates;", end=" ")
    print(f"{len(problem.fitted)} records to fit, {samples} samples\n")
    print(f"{'':27}{'right':>9}{'error':>9}{'processor':>11}{'lines':>11}   named")
    base = best_subset.fit(problem)
    print(f"{'the model as it is':27}{'':9}{problem.error_percent(lambda r: problem.predict(r, base)):8.2f}%")
    figures: dict[str, float] = {}
    for rival in RIVALS:
        figures |= _row(problem, rival)
    return {f"systems_{problem.key}_{name}": value for name, value in figures.items()}


def _row(problem: KnownProblem, rival: Rival) -> dict[str, float]:
    written = problem.model_lines + (problem.terms_lines if rival.by_terms else 0)
    if rival.by_terms and problem.terms is None:
        print(f"{rival.name:27}{'':40}   {problem.no_terms}", flush=True)
        return {}
    began = time.process_time()
    answer = rival.solve(problem)
    seconds, error = time.process_time() - began, problem.error_percent(answer.predict)
    right, named = judged(problem, answer)
    lines = f"{written} + {rival.lines}"
    print(f"{rival.name:27}{right:>9}{error:8.2f}%{seconds:10.1f}s{lines:>11}   {named}", flush=True)
    found = {"error_percent": error, "processor_seconds": seconds, "lines": float(written + rival.lines)}
    if answer.named is not None:
        found["right"] = float(right == "yes")
    return {f"{rival.key}_{name}": float(np.round(value, 6)) for name, value in found.items()}


def judged(problem: KnownProblem, answer: RivalAnswer) -> tuple[str, str]:
    """Whether exactly the present effects were named, with the expected verdict if there is one; and what was named."""
    if answer.named is None:
        return "-", "(it names nothing)"
    named = " + ".join(sorted(answer.named))
    right = set(answer.named) == problem.truth and answer.verdict in ("", problem.expected)
    return "yes" if right else "no", ": ".join(filter(None, (answer.verdict, named))) or "nothing"
