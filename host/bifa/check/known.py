"""Implausible values in `[known]`: a wrong unit, a reversed sign, exchanged supplies, a misspelt name.

The ranges of plausible and of computable values are in the model's own table (bifa.robot.parameters).
"""

from collections.abc import Iterator, Mapping
from difflib import get_close_matches

from bifa.check.finding import Finding
from bifa.data.layout import TABLE_FILE
from bifa.printable import printable
from bifa.robot.parameters import BASE_PARAMETERS, ModelParameter

# Size of other units in terms of the parameter's unit. A unit is suggested only if it makes the value plausible.
_UNITS = {
    "kg": {"g": 1e-3},
    "m": {"mm": 1e-3, "cm": 1e-2},
    "N/m": {"N/mm": 1e3},
    "N s/m": {"N s/mm": 1e3},
    "N/psi": {"N/kPa": 6.894757, "N/bar": 0.06894757},
    "psi": {"kPa": 0.1450377, "bar": 14.50377, "mbar": 0.01450377, "inHg": 0.4911542, "mmHg": 0.01933678},
}
_ATMOSPHERE_PSI = 14.696
_SUPPLIES = ("supply_positive_psi", "supply_negative_psi")


def check_known(known: Mapping[str, float]) -> Iterator[Finding]:
    """Yield a finding for each value that cannot be right. An implausible value without a recognisable mistake is
    assumed to belong to another robot, and reported only if the model cannot compute with it."""
    positive, negative = (known.get(name) for name in _SUPPLIES)
    exchanged = positive is not None and negative is not None and positive < 0.0 < negative
    if exchanged:
        text = (
            f"supply_positive_psi = {positive:g} psi and supply_negative_psi = {negative:g} psi: the supplies are "
            "exchanged; the positive one must be above 0, the vacuum below 0"
        )
        yield Finding("known", text, TABLE_FILE, column="[known]")
    for name, value in known.items():
        if name not in BASE_PARAMETERS:
            near = get_close_matches(name, BASE_PARAMETERS, 1)
            meant = f"; is it {near[0]}?" if near else f"; it has {', '.join(BASE_PARAMETERS)}."
            text = f"the model has no parameter {printable(name)}{meant} A fit refuses it"
            yield Finding("known", text, TABLE_FILE, column="[known]")
        elif not (exchanged and name in _SUPPLIES) and (cause := _cause(BASE_PARAMETERS[name], value)):
            unit, (low, high) = BASE_PARAMETERS[name].unit, BASE_PARAMETERS[name].plausible
            text = f"{name} = {value:g} {unit}".rstrip() + f", where {low:g} to {high:g} is plausible: {cause}"
            yield Finding("known", text, TABLE_FILE, column="[known]")


def _cause(parameter: ModelParameter, value: float) -> str | None:
    low, high = parameter.plausible
    if low <= value <= high:
        return None
    if low <= -value <= high:
        return f"its sign is reversed; write {-value:g}"
    for unit, size in _UNITS.get(parameter.unit, {}).items():
        if low <= value * size <= high:
            return f"it looks like a value in {unit}; write {value * size:.4g}"
    if parameter.unit == "psi" and low <= value - _ATMOSPHERE_PSI <= high:
        return f"it looks like an absolute pressure, but gauge is expected; write {value - _ATMOSPHERE_PSI:.4g}"
    if parameter.lower <= value <= parameter.upper:
        return None
    if parameter.lower <= -value <= parameter.upper:
        return f"its sign is reversed; write {-value:g}"
    return f"the model is limited to {parameter.lower:g} to {parameter.upper:g}; check number and unit"
