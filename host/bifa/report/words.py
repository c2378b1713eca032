"""Names in plain words: quantities with units, effects with their sizes, and text without identifiers."""

import re
from collections.abc import Mapping
from math import floor, log10

from bifa.effects import library
from bifa.ranges import CHAMBERS
from bifa.robot.parameters import BASE_PARAMETERS

# Phrases for the values of effects; without a phrase, an effect's values are listed with their meanings.
_PHRASES = {
    "area_variation": "{slope} over the stroke",
    "backlash": "{gap_m}",
    "choked_flow": "bending at {saturation_s_per_psi}",
    "friction_direction": "{asymmetry} either way",
    "hysteresis": "{force_N} over {displacement_m}",
    "inclination": "{angle_deg}",
    "instrument_shift": "{late_s}",
    "leak": "{rate_per_s}",
    "line_lag": "{time_s}",
    "regulator_ripple": "{amplitude_psi} at {frequency_Hz}",
    "sensor_calibration": "{gain} in gain, {offset_psi} in offset",
    "sensor_lag": "{time_s}",
    "sensor_position": "{share} of the line's drop",
    "stribeck": "falling by {speed_m_s}",
    "supply_sag": "{resistance_s} of drop per psi/s",
    "tether_drag": "{drag_N_m}",
    "valve_asymmetry": "{difference_s} between the edges",
    "valve_latency": "{delay_s}",
    "viscoelasticity": "{stiffness_N_m} relaxing in {time_s}",
}
NBSP = "\N{NO-BREAK SPACE}"  # between a number and its unit
_UNIT = re.compile("_(N_psi|Ns_m|N_m|s_per_psi|per_s|mm_s|m_s|mm|psi|N|m|kg|deg|Hz|s|rad)$")
_IDENTIFIER = re.compile(r"\b[A-Za-z][A-Za-z0-9]*(?:_[A-Za-z0-9]+)+\b")
_FILE = re.compile(r"[\w.\-]+\.csv\b")


def quantity(value: float, unit: str, digits: int = 2) -> str:
    """Return a value in a unit that suits its size: 0.00274 m is "2.7 mm"."""
    for small, scale, least in (("m", ("mm", 1e3), 1.0), ("s", ("ms", 1e3), 1.0), ("m/s", ("mm/s", 1e3), 10.0)):
        if unit == small and abs(value) < least:
            unit, value = scale[0], value * scale[1]
            break
    return f"{plain(value, digits)}{NBSP}{unit}".rstrip()


def plain(value: float, digits: int = 3) -> str:
    """Format with at least `digits` significant digits, and no exponent for values from 1e-4 to 1e6."""
    if value == 0.0 or not 1e-4 <= abs(value) < 1e6:
        return f"{value:.{digits}g}"
    decimals = max(0, digits - 1 - floor(log10(abs(value))))
    return f"{value:.{decimals}f}"


def experiment_words(name: str) -> str:
    """Return an experiment's name in words: "static_loading" is "static loading", "locomotion" is "walk"."""
    return "walk" if name == "locomotion" else name.replace("_", " ")


def channel_words(name: str) -> str:
    """Return a channel's name in words: "pressure_body_psi" is "pressure of the body"."""
    words = _UNIT.sub("", name).split("_")
    if words[-1] in CHAMBERS and len(words) > 1:
        return f"{' '.join(words[:-1])} of the {words[-1]}"
    return " ".join(words)


def unit_of(name: str) -> str:
    """Return the unit that a column's name ends in: "psi" for "pressure_body_psi"."""
    return name.rpartition("_")[2]


def gait_words(gait: Mapping[str, float]) -> str:
    """Return a gait in words, such as "2.72 s, head 204° and tail 332° ahead, vacuum in 0.65 (body), 0.44 (head) and
    0.44 (tail) of the cycle"."""
    head, tail = (f"{gait[f'psi1{i}_deg']:.0f}°" for i in (2, 3))
    body, front, rear = (f"{gait[f'duty_{part}']:.2f}" for part in CHAMBERS)
    vacuum = f"vacuum in {body} (body), {front} (head) and {rear} (tail) of the cycle"
    return f"{plain(gait['period_s'])}{NBSP}s, head {head} and tail {tail} ahead, {vacuum}"


def gait_parameter_words(name: str) -> str:
    """Return the name of a gait's parameter in words, such as "period, s" or "vacuum, body"."""
    words = {"period_s": "period, s", "psi12_deg": "head ahead, °", "psi13_deg": "tail ahead, °"}
    return words.get(name, name.replace("duty_", "vacuum, "))


def parameter_words(name: str) -> str:
    """Return the name of a parameter in words: the model's, an effect's, or a nuisance."""
    known = BASE_PARAMETERS.get(name)
    return known.meaning if known else _UNIT.sub("", name).replace("_", " ")


def effect_words(name: str, parameters: Mapping[str, float] | None = None) -> str:
    """Return an effect in words, such as "hysteresis, 4.4 N over 2.7 mm"; without parameters, only its name."""
    called = name.replace("_", " ")
    if not parameters:
        return called
    effects = library()
    units = {p.name: p.unit for p in effects[name].parameters} if name in effects else {}
    values = {key: quantity(value, units.get(key, "")) for key, value in parameters.items()}
    phrase = _PHRASES.get(name)
    if phrase is None or any(f"{{{key}}}" in phrase and key not in values for key in units):
        return f"{called}, " + ", ".join(f"{parameter_words(key)} {value}" for key, value in values.items())
    return f"{called}, {phrase.format(**values)}"


def effect_parameter(effect: str, name: str) -> tuple[str, str]:
    """Return the meaning and unit of an effect's parameter; if the library lacks the effect, its name and no unit."""
    effects = library()
    for parameter in effects[effect].parameters if effect in effects else ():
        if parameter.name == name:
            return parameter.meaning, parameter.unit
    return parameter_words(name), ""


def spoken(text: str, labels: Mapping[str, str] | None = None) -> str:
    """Replace identifiers in a text of the engine by words; `labels` names the trials by file."""
    if labels:
        text = _FILE.sub(lambda found: labels.get(found[0], found[0]), text)
    text = (
        _IDENTIFIER.sub(lambda found: _identifier_words(found[0]), text)
        .replace("locomotion", "walking")
        .replace(" x the ", " × the ")
        .replace("+-", "±")
    )
    return text[:1].upper() + text[1:]


def _identifier_words(name: str) -> str:
    if name in BASE_PARAMETERS or name in library():
        return parameter_words(name)
    return channel_words(name)
