"""What is known of the robot before anything is fitted: from the rig's own declaration, and from the person."""

from collections.abc import Iterable, Mapping

from bifa.rig import Rig
from bifa.robot.parameters import BASE_PARAMETERS, ModelParameterError, check_bounds


def parse_known(given: Iterable[str]) -> dict[str, float]:
    """`NAME=VALUE` texts as a person types them. ModelParameterError names what is unknown or out of bounds."""
    known = {}
    for text in given:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise ModelParameterError(f"{text!r}: write it as NAME=VALUE, for example head_mass_kg=0.182")
        if name not in BASE_PARAMETERS:
            raise ModelParameterError(f"the model has no parameter {name!r}; it has {', '.join(BASE_PARAMETERS)}")
        parameter = BASE_PARAMETERS[name]
        try:
            known[name] = float(value)
        except ValueError:
            raise ModelParameterError(f"{name} must be a number, not {value!r}") from None
        check_bounds(name, known[name], parameter.lower, parameter.upper, parameter.unit)
    return known


def known_of(rig: Rig, given: Mapping[str, float]) -> dict[str, float]:
    """`[known]` of a data set recorded on `rig`: what the rig declares, and before it what the person has `given`."""
    return {**rig.known, **given}
