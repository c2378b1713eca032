"""Conversion of parameters between decimal units and the integers sent on the wire."""

import math
import struct
from collections.abc import Mapping
from decimal import ROUND_HALF_UP, Decimal

from bifa.errors import BifaError
from bifa.link.table import CONVERTER_COUNTS, PARAMETERS, REGULATOR_SPAN_MPSI, SET_FORMAT, UnoParameter

BY_NAME = {parameter.name: parameter for parameter in PARAMETERS}


class UnoParameterError(BifaError):
    """A parameter does not exist, or its value is out of range."""


def _parameter(name: str) -> UnoParameter:
    try:
        return BY_NAME[name]
    except KeyError:
        raise UnoParameterError(f"there is no parameter {name!r}; there are {', '.join(BY_NAME)}") from None


def range_text(parameter: UnoParameter) -> str:
    """Return the range of a parameter in words, such as "0.5 to 60 s"."""
    low, high = (from_wire(parameter.name, bound) for bound in (parameter.minimum, parameter.maximum))
    return f"{low:g} to {high:g} {parameter.unit}".rstrip()


def to_wire(name: str, value: float) -> int:
    """Return the integer that encodes `value` (in the unit that the name ends in), rounded half up as on the Uno.

    Raises UnoParameterError, which states the range, for an unknown name, NaN, infinity and values out of range.
    """
    parameter = _parameter(name)
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise UnoParameterError(f"{name} must be a number, {range_text(parameter)}, not {value!r}")
    scaled = Decimal(str(value)).scaleb(parameter.decimals)
    if not parameter.minimum <= scaled <= parameter.maximum:
        raise UnoParameterError(f"{name} = {value:g} is out of range: {range_text(parameter)}")
    return int(scaled.to_integral_value(ROUND_HALF_UP))


def from_wire(name: str, value: int) -> float:
    """Return the value that an integer encodes, in the unit that the name ends in."""
    return float(Decimal(value).scaleb(-_parameter(name).decimals))


def set_point_psi(pressure_psi: float) -> float:
    """Set point sent to the regulator for `pressure_psi`: whole counts of the converter, rounded down
    (lib/pressure/supply.h)."""
    counts = int(round(pressure_psi * 1e3) * CONVERTER_COUNTS // REGULATOR_SPAN_MPSI)
    return counts * REGULATOR_SPAN_MPSI / CONVERTER_COUNTS * 1e-3


def index_of(name: str) -> int:
    """Return the number of a parameter on the wire."""
    return PARAMETERS.index(_parameter(name))


def unpack_set(data: bytes) -> dict[str, int]:
    """Decode the bytes of a parameter set, to wire units."""
    return dict(zip(BY_NAME, struct.unpack(SET_FORMAT, data), strict=True))


def pack_set(values: Mapping[str, int]) -> bytes:
    """Encode a parameter set given in wire units."""
    return struct.pack(SET_FORMAT, *(values[name] for name in BY_NAME))
