"""A curve learnt from data in the equation where the discrepancy lives: for what no effect of the library explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bifa.discrepancy.candidate import Candidate
from bifa.discrepancy.split import Split
from bifa.identify.fit import Fit, evaluate_on, fit, refit_on, starting_point
from bifa.identify.structure import Structure
from bifa.identify.system import Correction

_ITERATIONS = 15


@dataclass(frozen=True)
class Corrected:
    """An explanation with a learnt curve at `site`, which stands for `term`, fitted to all known trials."""

    site: str
    term: str
    fitted: Fit
    curve: Correction


def learn_correction(candidates: Sequence[Candidate], split: Split) -> Corrected | None:
    """The best curve at any of the system's sites on top of any of `candidates`; None if none helps the
    trials that it was not fitted to."""
    best: tuple[float, Fit, str] | None = None
    for candidate in candidates:
        system = candidate.fitted.structure.system
        for site in system.correction_sites:
            structure = Structure(system, candidate.effects, (site,))
            start = starting_point(candidate.fitted, structure)
            fitted = fit(
                structure, split.fit, candidate.fitted.problem.floor, starts=[start], max_iterations=_ITERATIONS
            )
            unseen = evaluate_on(fitted, split.select).cost
            if unseen < candidate.checked.cost and (best is None or unseen < best[0]):
                best = unseen, fitted, site
    if best is None:
        return None
    _, fitted, site = best
    refitted = refit_on(fitted, split.known)
    (curve,) = refitted.structure.corrections(refitted.theta)
    return Corrected(site, fitted.structure.system.correction_sites[site].term, refitted, curve)


def holds(corrected: Corrected, before: Fit, split: Split) -> bool:
    """Whether the curve also helps on the trials that informed nothing."""
    if not split.final:
        return False
    return evaluate_on(corrected.fitted, split.final).cost < evaluate_on(before, split.final).cost
