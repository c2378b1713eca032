"""Parameters that act in steps, such as a delay counted in whole samples: within a step, no prediction changes."""

from collections.abc import Callable, Sequence

from lacuna.check.model import initial, predict_unchecked
from lacuna.check.numbers import differ
from lacuna.system import Channels, Parameter, Record, System, Theta

_REL_STEP = 0.02  # of a parameter's scale: derivative step; if it changes nothing, the parameter acts in larger ones
_DOUBLED, _HALVED = 10, 14  # number of doublings and bisections of the interval when locating an edge between steps

Predict = Callable[[float], Channels]


def grains_of(system: System, trials: Sequence[Record]) -> dict[str, float]:
    """Width of a step of each parameter that acts in steps, by its full name, in the parameter's fitted units and with
    effects at their typical sizes. Costs three simulations of a trial for each of the other parameters."""
    start = initial(system)
    widths = {p.name: _width(system, start, p.name, p, (), trials) for p in system.parameters}
    for effect in system.effects.values():
        seen, typical = [t for t in trials if effect.shows_in(t)], start | effect.typical
        for p in effect.parameters:
            name = effect.full_name(p)
            widths[name] = _width(system, typical, name, p, (effect.name,), seen)
    return {name: width for name, width in widths.items() if width}


def _width(
    system: System, theta: Theta, name: str, parameter: Parameter, effects: tuple[str, ...], trials: Sequence[Record]
) -> float:
    """Distance between adjacent edges, in the first trial that has two; 0 if small changes affect a prediction."""
    small = _REL_STEP * parameter.step_scale
    small = small if parameter.value + 2.0**_DOUBLED * small <= parameter.upper else -small
    for trial in trials:

        def predict(value: float, trial: Record = trial) -> Channels:
            found = predict_unchecked(system, {**theta, name: value}, effects, trial)
            return {channel: found[channel] for channel in trial.channels}

        # An initial value that is a whole number of samples may lie right before an edge.
        first, second, third = (predict(parameter.value + k * small) for k in range(3))
        if _changes(first, second) and _changes(second, third):
            return 0.0
        edge = _edge(predict, parameter, parameter.value + small, small)
        following = edge and _edge(predict, parameter, edge, small)
        if edge and following and abs(following - edge) > abs(small):
            return abs(following - edge)
    return 0.0


def _edge(predict: Predict, parameter: Parameter, begin: float, small: float) -> float | None:
    """The nearest value beyond `begin` at which predictions change; None if there is none within the bounds."""
    here, within, step = predict(begin), begin, small
    for _ in range(_DOUBLED):
        beyond = begin + step
        if not parameter.lower <= beyond <= parameter.upper:
            return None
        if _changes(here, predict(beyond)):
            for _ in range(_HALVED):
                middle = 0.5 * (within + beyond)
                within, beyond = (within, middle) if _changes(here, predict(middle)) else (middle, beyond)
            return beyond
        within, step = beyond, 2.0 * step
    return None


def _changes(one: Channels, other: Channels) -> bool:
    return any(differ(column, other[name], 0.0) for name, column in one.items())
