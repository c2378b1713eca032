"""Reads the tables of this folder and checks that they make sense."""

import tomllib
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

FOLDER = Path(__file__).parent
WIRE_BYTES = {"u8": 1, "u16": 2, "i16": 2, "u32": 4}


@dataclass(frozen=True)
class Parameter:
    """One parameter; `minimum`, `maximum` and `default` are integers in wire units."""

    name: str
    field: str
    wire: str
    decimals: int
    unit: str
    minimum: int
    maximum: int
    default: int
    since: int
    help: str


@dataclass(frozen=True)
class Preset:
    """A factory preset: one value in wire units for every parameter, in the table's order."""

    name: str
    help: str
    values: tuple[int, ...]


@dataclass(frozen=True)
class ParameterTable:
    storage_format: int
    parameters: tuple[Parameter, ...]
    presets: tuple[Preset, ...]


def _load(name: str) -> dict:
    return tomllib.loads((FOLDER / name).read_text(), parse_float=Decimal)


def _to_wire(value: int | Decimal, decimals: int) -> int:
    scaled = Decimal(value).scaleb(decimals)
    if scaled != int(scaled):
        raise ValueError(f"{value} has more than {decimals} decimals")
    return int(scaled)


def parameter_table() -> ParameterTable:
    """The parameters, the factory presets and the storage format of parameters.toml."""
    raw = _load("parameters.toml")
    parameters = []
    for row in raw["parameter"]:
        bounds = {key: _to_wire(row[key], row["decimals"]) for key in ("minimum", "maximum", "default")}
        parameter = Parameter(**{**row, **bounds})
        if not 0 <= parameter.minimum <= parameter.default <= parameter.maximum:
            raise ValueError(f"{parameter.name}: the default lies outside its range")
        if parameter.maximum >= 1 << 8 * WIRE_BYTES[parameter.wire]:
            raise ValueError(f"{parameter.name}: the maximum does not fit {parameter.wire}")
        if not 1 <= parameter.since <= raw["storage_format"]:
            raise ValueError(f"{parameter.name}: since must be a storage format")
        parameters.append(parameter)
    widths = [WIRE_BYTES[p.wire] for p in parameters]
    if widths != sorted(widths, reverse=True):
        raise ValueError("wide parameters come first, so that the struct has no holes on any machine")
    presets = [
        Preset(
            row["name"],
            row["help"],
            tuple(_to_wire(row[p.name], p.decimals) if p.name in row else p.default for p in parameters),
        )
        for row in raw["preset"]
    ]
    return ParameterTable(raw["storage_format"], tuple(parameters), tuple(presets))
