"""What is fitted: the base model, some effects of the library, and curves learnt at some sites, as one vector."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from lacuna.system import LEARNT, Correction, CorrectionSite, Parameter, Record, System, Theta

_RELEASED = 20.0  # times its standard deviation: a prior that hardly counts, and yet holds what nothing else does
_TABLE_INTERVALS = 64  # at least


@dataclass(frozen=True)
class Structure:
    """The base model of a system plus `effects` plus corrections at `sites`; the order of the fitted vector
    is base, effects, corrections."""

    system: System
    effects: tuple[str, ...] = ()
    sites: tuple[str, ...] = ()

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        found = list(self.system.parameters)
        for name in self.effects:
            effect = self.system.effects[name]
            found += [replace(p, name=effect.full_name(p)) for p in effect.parameters]
        for name in self.sites:
            found += _knot_parameters(self.system.correction_sites[name])
        return tuple(found)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    def nuisances(self, trial: Record) -> tuple[Parameter, ...]:
        """What varies from run to run, with the effects' own parameters of this trial last."""
        return (*self.system.nuisances(trial), *self.own(trial))

    def own(self, trial: Record) -> tuple[Parameter, ...]:
        """The effects' parameters of which this trial has its own value: anywhere, if nothing is said of its spread."""
        return tuple(
            replace(p, name=effect.full_name(p), scale=p.scale or 0.25 * (p.upper - p.lower))
            for effect in (self.system.effects[name] for name in self.effects)
            if effect.shows_in(trial)
            for p in effect.own
        )

    @property
    def base_size(self) -> int:
        return len(self.system.parameters)

    def start(self) -> np.ndarray:
        """Start of the base, effects absent (their size at its null, other parameters typical), corrections zero."""
        effects = [self.system.effects[name] for name in self.effects]
        return self.values({size: effect.absent for effect in effects for size in effect.size_names})

    def prior_mean(self) -> np.ndarray:
        return np.array([p.value for p in self.parameters])

    def bounds(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the parameters lie between, the others being as in `values`."""
        lower, upper = np.array([p.lower for p in self.parameters]), np.array([p.upper for p in self.parameters])
        for index, floor in self.ordered:
            lower[index] = max(lower[index], values[floor])
        return lower, upper

    def lifted(self, values: np.ndarray) -> np.ndarray:
        """`values` with those raised that are below the one that they cannot be below."""
        values = values.copy()
        for index, floor in self.ordered:
            values[index] = max(values[index], values[floor])
        return values

    def parted(self, values: np.ndarray, effect: str) -> np.ndarray:
        """`values` with the parameters that `effect` needs apart (`Effect.apart`) at least half as far above what they
        cannot be below as they are at the start."""
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
        """The vector for `theta`; what it lacks stands at the start."""
        return np.array([theta.get(p.name, p.value) for p in self.parameters])

    def corrections(self, theta: Theta) -> tuple[Correction, ...]:
        """The learnt curves, knots interpolated by a natural cubic spline onto a uniform table."""
        return tuple(_tabulate(self.system.correction_sites[name], theta) for name in self.sites)

    def prior_precision(self, released: bool = False, sizes: Mapping[str, float] | None = None) -> np.ndarray:
        """Precision of the prior around the parameters' starts, shape (P, P): what was known of each, and for learnt
        curves knots within 10 scales of zero, or within the size of the curve at a site if `sizes` has it, and bending
        within 3 scales a knot. `released`: what was known from the trials themselves hardly counts, or they would count
        twice."""
        wider = [_RELEASED if released and p.prior_from_trials else 1.0 for p in self.parameters]
        sds = zip((p.prior_sd for p in self.parameters), wider, strict=True)
        precision = np.diag([(sd * factor) ** -2.0 if sd else 0.0 for sd, factor in sds])
        for name in self.sites:
            site = self.system.correction_sites[name]
            bend = np.diff(np.eye(site.knots), 2, axis=0)
            scales = sizes[name] / site.scale if sizes and name in sizes else 10
            block = (np.eye(site.knots) / scales**2 + bend.T @ bend / 3**2) / site.scale**2
            for row in range(len(site.rows)):
                at = self.names.index(knot_name(site, row, 0))
                precision[at : at + site.knots, at : at + site.knots] = block
        return precision

    def moves(self, index: int, trial: Record) -> bool:
        """Whether parameter `index` can change a trial at all."""
        if index < self.base_size:
            return self.system.matters(self.names[index], trial)
        owner = self.names[index].split(".")
        experiments = (
            self.system.correction_sites[owner[1]].experiments
            if owner[0] == LEARNT
            else self.system.effects[owner[0]].experiments
        )
        return not experiments or trial.experiment in experiments


def is_learnt(name: str) -> bool:
    """Whether this parameter is a knot of a learnt curve."""
    return name.startswith(f"{LEARNT}.")


def knot_name(site: CorrectionSite, row: int, knot: int) -> str:
    """The parameter's."""
    return f"{LEARNT}.{site.name}.{row}_{knot}"


def _knot_parameters(site: CorrectionSite) -> list[Parameter]:
    far = 50 * site.scale
    return [
        Parameter(knot_name(site, row, knot), site.unit, 0.0, -far, far, scale=site.scale, source="learnt")
        for row in range(len(site.rows))
        for knot in range(site.knots)
    ]


def _tabulate(site: CorrectionSite, theta: Mapping[str, float]) -> Correction:
    rows = range(len(site.rows))
    values = np.array([[theta[knot_name(site, row, k)] for k in range(site.knots)] for row in rows])
    return Correction(site.name, values @ _splines(site.knots))


@cache
def _splines(knots: int) -> np.ndarray:
    """Of each knot the natural cubic spline that is 1 there and 0 at the others, on the table's grid: a curve is their
    sum. Shape (knots, n)."""
    each = max(_TABLE_INTERVALS // (knots - 1), 2)  # intervals of the table between two knots
    at = np.linspace(0, 1, each * (knots - 1) + 1)
    return CubicSpline(np.linspace(0, 1, knots), np.eye(knots), bc_type="natural")(at).T
