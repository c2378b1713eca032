"""The fitted parameters as one vector: those of the base model, some effects of the library, and learnt curves."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from lacuna.system import LEARNT, Correction, CorrectionSite, Parameter, Record, System, Theta

_RELAXED_FACTOR = 20.0  # widens a relaxed prior: it hardly counts, but still holds what the data do not determine
_TABLE_INTERVALS = 64  # of a tabulated curve, about


@dataclass(frozen=True)
class Structure:
    """The base model of a system, plus `effects`, plus corrections at `sites`. The fitted vector is in this order."""

    system: System
    effects: tuple[str, ...] = ()
    sites: tuple[str, ...] = ()

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        found = list(self.system.parameters)
        for name in self.effects:
            effect = self.system.effects[name]
            found += [replace(p, name=effect.full_name(p)) for p in effect.parameters]
        for site in (self.system.correction_sites[name] for name in self.sites):
            far = 50 * site.scale
            found += [
                Parameter(knot, site.unit, 0.0, -far, far, scale=site.scale, source="learnt")
                for row in knot_names(site)
                for knot in row
            ]
        return tuple(found)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    def nuisances(self, trial: Record) -> tuple[Parameter, ...]:
        """Nuisances of a trial, followed by the effects' own parameters in this trial."""
        return (*self.system.nuisances(trial), *self.own(trial))

    def own(self, trial: Record) -> tuple[Parameter, ...]:
        """Effects' parameters with a separate value in this trial; without a `scale`, spread over their whole range."""
        return tuple(
            replace(p, name=effect.full_name(p), scale=p.scale or 0.25 * (p.upper - p.lower))
            for effect in (self.system.effects[name] for name in self.effects)
            if effect.shows_in(trial)
            for p in effect.own
        )

    def start(self, known: Theta | None = None) -> np.ndarray:
        """Initial vector: parameters that are not `known` at their initial values, effects absent, corrections zero."""
        effects = [self.system.effects[name] for name in self.effects]
        absent = {size: effect.absent for effect in effects for size in effect.size_names}
        return self.values(absent | dict(known or {}))

    def prior_mean(self) -> np.ndarray:
        return np.array([p.value for p in self.parameters])

    def bounds(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds, given that ordered parameters are limited by those in `values`."""
        lower, upper = np.array([p.lower for p in self.parameters]), np.array([p.upper for p in self.parameters])
        for index, floor in self.ordered:
            lower[index] = max(lower[index], values[floor])
        return lower, upper

    def raise_to_limits(self, values: np.ndarray) -> np.ndarray:
        """Return `values` with ordered parameters raised to their limits (`Parameter.at_least`)."""
        values = values.copy()
        for index, floor in self.ordered:
            values[index] = max(values[index], values[floor])
        return values

    def separate_ordered(self, values: np.ndarray, effect: str) -> np.ndarray:
        """Return `values` with parameters in `Effect.apart` at least half their initial distance above their limits."""
        values, start = values.copy(), self.start()
        for index, floor in self.ordered:
            if self.names[index] in self.system.effects[effect].apart:
                values[index] = max(values[index], values[floor] + 0.5 * (start[index] - start[floor]))
        return np.minimum(values, [p.upper for p in self.parameters])

    @cached_property
    def ordered(self) -> tuple[tuple[int, int], ...]:
        """Pairs of indices: the first parameter cannot be below the second."""
        pairs = [(p.name, p.at_least) for p in self.parameters if p.at_least in self.names]
        return tuple((self.names.index(name), self.names.index(floor)) for name, floor in pairs)

    def scales(self) -> np.ndarray:
        return np.array([p.step_scale for p in self.parameters])

    def grains(self) -> np.ndarray:
        return np.array([p.grain for p in self.parameters])

    def theta(self, values: np.ndarray) -> dict[str, float]:
        return dict(zip(self.names, values.tolist(), strict=True))

    def values(self, theta: Theta) -> np.ndarray:
        """Return the vector for `theta`; parameters that it lacks have their initial values."""
        return np.array([theta.get(p.name, p.value) for p in self.parameters])

    def corrections(self, theta: Theta) -> tuple[Correction, ...]:
        """Return the learnt curves, interpolated from their knots onto a uniform table by a natural cubic spline."""
        found = []
        for site in (self.system.correction_sites[name] for name in self.sites):
            knots = np.array([[theta[knot] for knot in row] for row in knot_names(site)])
            found.append(Correction(site.name, knots @ _splines(site.knots)))
        return tuple(found)

    def prior_precision(self, relax_priors: bool = False, sizes: Mapping[str, float] | None = None) -> np.ndarray:
        """Precision of the prior around the initial values, shape (P, P): the declared priors, and for learnt curves
        knots within 10 scales of zero (or within the site's entry in `sizes`) and second differences within 3 scales.
        `relax_priors` relaxes priors that were estimated from the trials themselves, so that these do not count
        twice."""
        wider = [_RELAXED_FACTOR if relax_priors and p.prior_from_trials else 1.0 for p in self.parameters]
        sds = zip((p.prior_sd for p in self.parameters), wider, strict=True)
        precision = np.diag([(sd * factor) ** -2.0 if sd else 0.0 for sd, factor in sds])
        for name in self.sites:
            site = self.system.correction_sites[name]
            bend = np.diff(np.eye(site.knots), 2, axis=0)
            scales = sizes[name] / site.scale if sizes and name in sizes else 10
            block = (np.eye(site.knots) / scales**2 + bend.T @ bend / 3**2) / site.scale**2
            for row in knot_names(site):
                at = self.names.index(row[0])
                precision[at : at + site.knots, at : at + site.knots] = block
        return precision

    def moves(self, index: int, trial: Record) -> bool:
        """Whether parameter `index` can change a trial."""
        if index < len(self.system.parameters):
            return self.system.matters(self.names[index], trial)
        owner, own = self.names[index].split(".")[:2]
        acting = self.system.correction_sites[own] if owner == LEARNT else self.system.effects[owner]
        return not acting.experiments or trial.experiment in acting.experiments


def is_learnt(name: str) -> bool:
    """Whether `name` is that of a knot of a learnt curve."""
    return name.startswith(f"{LEARNT}.")


def knot_names(site: CorrectionSite) -> list[list[str]]:
    """Names of the parameters for the knots of a site's curves, a list for each row."""
    return [[f"{LEARNT}.{site.name}.{row}_{knot}" for knot in range(site.knots)] for row in range(len(site.rows))]


@cache
def _splines(knots: int) -> np.ndarray:
    """Natural cubic splines on the table's grid, shape (knots, n): row k is 1 at knot k and 0 at the others."""
    each = max(_TABLE_INTERVALS // (knots - 1), 2)  # intervals of the table between neighbouring knots
    at = np.linspace(0, 1, each * (knots - 1) + 1)
    return CubicSpline(np.linspace(0, 1, knots), np.eye(knots), bc_type="natural")(at).T
