"""A completed model fitted to more data, for as long as it lacks nothing."""

from collections.abc import Callable

from bifa.data import Dataset
from bifa.identify.completed import completed_model
from bifa.identify.start import before_fit, prepare
from bifa.problem.system import RobotSystem
from bifa.robot import Model
from lacuna.diagnosis.refit import refit


def refitted(
    dataset: Dataset, model: Model, seed: int = 0, on_progress: Callable[[str], None] = lambda _: None
) -> Model | None:
    """Return `model` fitted to `dataset`, which holds the trials that it was fitted to and more; None if it then leaves
    something that matters, or has learnt curves in its equations: the data then call for a diagnosis."""
    if model.learnt:
        return None
    system = prepare(dataset, before_fit(model))
    fit = refit(system, tuple(model.effects), values_of(system, model), seed=seed, on_progress=on_progress)
    return completed_model(fit) if fit else None


def values_of(system: RobotSystem, model: Model) -> dict[str, float]:
    """The parameters of `system` by name, as `model` has them: its own, those of its effects, its curves' shapes."""
    shapes: dict[str, float] = {}
    for name, curve in system.curves.items():
        shapes |= curve.weights_of(getattr(model, f"{name}_stiffness"))
    return {**model.values, **shapes}
