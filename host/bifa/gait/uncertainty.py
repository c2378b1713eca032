"""Robots that the model might be: draws of its parameters, the same for every gait (common random numbers)."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from bifa.errors import BifaError
from bifa.robot.model import Model
from bifa.robot.parameters import BASE_PARAMETERS
from bifa.simulate import Plant, plant

SPREAD = 0.02  # relative standard deviation where the model has no covariance


class UncertaintyError(BifaError):
    """The spread or the covariance cannot be drawn from; the text says why."""


@dataclass(frozen=True)
class Spread:
    """How the parameters vary: `names`, and `factor` (n, n) with covariance = factor @ factor.T."""

    names: tuple[str, ...]
    factor: np.ndarray
    text: str

    def plants(self, model: Model, count: int, seed: int) -> list[Plant]:
        """`count` perturbed models, flat. A draw beyond a parameter's bounds is put on the bound.

        Drawn as a scrambled Sobol sequence, so that few draws already cover the spread; numbers differ by seed.
        """
        power = max(0, int(np.ceil(np.log2(count))))
        unit = qmc.Sobol(len(self.names), scramble=True, rng=np.random.default_rng([seed, 4])).random_base2(power)
        normal = ndtri(np.clip(unit[:count], 1e-6, 1.0 - 1e-6))
        values = np.array([model[name] for name in self.names]) + normal @ self.factor.T
        lower, upper = np.transpose([_bounds(model, name) for name in self.names])
        values = np.clip(values, lower, upper)
        return [plant(model.with_values(dict(zip(self.names, row, strict=True)))) for row in values.tolist()]


def spread_of(model: Model, relative: float | None = None) -> Spread:
    """From the covariance of the model's fit where it has one; otherwise, or where `relative` is given, that
    relative standard deviation (2 % by default) on each of the base parameters, independently."""
    if model.covariance is not None and relative is None:
        values, vectors = np.linalg.eigh(model.covariance.matrix)
        if values.min() < -1e-9 * max(values.max(), 1e-300):
            raise UncertaintyError(
                f"the covariance of model {model.name!r} is not positive semidefinite; fit the model again, "
                "or give a relative spread"
            )
        factor = vectors * np.sqrt(np.maximum(values, 0.0))
        names = model.covariance.names
        return Spread(names, factor, f"the fit's covariance of {len(names)} parameters")
    share = SPREAD if relative is None else relative
    if not 0.0 < share <= 0.5:
        raise UncertaintyError(f"spread = {share:g} must be above 0 and at most 0.5")
    names = tuple(BASE_PARAMETERS)
    factor = np.diag([share * abs(model[name]) for name in names])
    return Spread(names, factor, f"{100 * share:g} % standard deviation of {len(names)} parameters, independent")


def _bounds(model: Model, name: str) -> tuple[float, float]:
    if name in model.parameters:
        return model.parameters[name].lower, model.parameters[name].upper
    from bifa.effects import library

    effect, _, own = name.partition(".")
    parameter = next(p for p in library()[effect].parameters if p.name == own)
    return parameter.lower, parameter.upper
