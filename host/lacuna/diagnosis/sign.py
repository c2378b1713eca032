"""Effects that would explain part of the residual if their bounds allowed the other sign."""

from __future__ import annotations

import numpy as np

from lacuna.diagnosis.linear import remaining_after
from lacuna.diagnosis.policy import Policy
from lacuna.estimation.fit import Fit
from lacuna.estimation.problem import Problem
from lacuna.estimation.structure import Structure

_STEP = 0.1  # of the typical size: as far as a derivative at the absent size looks


def impossible_signs(fitted: Fit, policy: Policy) -> list[str]:
    """A sentence for each effect with one size, absent at a bound, that the residual of `fitted` would push beyond that
    bound: if a linear regression on it removes more than the policy's share of the residual."""
    system, problem = fitted.structure.system, fitted.problem
    basis, remaining = remaining_after(fitted)
    reference = problem.residuals(fitted.solution.point)
    found = []
    for name, effect in system.effects.items():
        size = effect.parameters[0]
        if name in fitted.structure.effects or effect.sizes > 1 or effect.absent not in (size.lower, size.upper):
            continue
        structure = Structure(system, (*fitted.structure.effects, name))
        absent = structure.theta(structure.start()) | fitted.theta
        moved = absent | {effect.full_name(size): effect.absent + _STEP * (size.value - effect.absent)}
        wider = Problem(structure, problem.trials, problem.floor, problem.view)
        there = wider.residuals(wider.start(structure.values(moved), fitted.solution.point.nuisances))
        change = np.concatenate([a - b for a, b in zip(there, reference, strict=True)])
        left = change - basis @ (basis.T @ change)
        square, push = float(left @ left), float(left @ remaining)  # positive: less of the effect fits better
        share = push**2 / max(square * float(remaining @ remaining), 1e-300)
        if push > 0.0 and share > policy.share:
            told, typical = (system.told(effect.full_name(size), value) for value in (effect.absent, size.value))
            side, bound = "below" if told < typical else "above", f"{told:g} {size.unit}".rstrip()
            found.append(f"{name} would fit with a {size.name} {side} {bound}, which its bounds forbid.")
    return found
