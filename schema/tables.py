"""Read the tables in this folder and validate them."""

import hashlib
import json
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

FOLDER = Path(__file__).parent
NAME_BYTES = 12
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


@dataclass(frozen=True)
class Field:
    """One field of a message: `wire` is u8, u16, u32, i16, name or set; `count` > 1 for an array."""

    name: str
    wire: str
    count: int


@dataclass(frozen=True)
class Message:
    """The contents of one frame; `fields` follow the message number and the sequence number.

    `answer`: name of the report that answers it, if that is not "done".
    """

    name: str
    number: int
    kind: str
    fields: tuple[Field, ...]
    help: str
    answer: str | None = None

    def size(self, set_size: int) -> int:
        """Return the size of all fields in bytes; `set_size` is that of a parameter set."""
        widths = {**WIRE_BYTES, "name": NAME_BYTES, "set": set_size}
        return sum(widths[f.wire] * f.count for f in self.fields)


@dataclass(frozen=True)
class Command:
    """A command; `usage` is its form on the console, `message` its form in a frame; either may be None."""

    name: str
    usage: str | None
    message: Message | None
    help: str

    def words(self) -> tuple[int, int]:
        """Return the least and greatest number of words of a line, command included; bracketed ones are optional."""
        words = self.usage.split(" ")
        return len(words) - sum(word.startswith("[") for word in words), len(words)


@dataclass(frozen=True)
class CommandTable:
    protocol_version: int
    firmware_version: tuple[int, int, int]
    commands: tuple[Command, ...]
    reports: tuple[Message, ...]
    results: tuple[tuple[str, str], ...]
    words: dict[str, list[str]]
    fault_units: dict[str, tuple[str, int]]


@dataclass(frozen=True)
class Constant:
    """A constant of the firmware that the host needs as well."""

    name: str
    wire: str
    value: int
    help: str
    unit: str = ""


def _load(name: str) -> dict:
    return tomllib.loads((FOLDER / name).read_text(), parse_float=Decimal)


def _to_wire(value: int | Decimal, decimals: int) -> int:
    scaled = Decimal(value).scaleb(decimals)
    if scaled != int(scaled):
        raise ValueError(f"{value} has more than {decimals} decimals")
    return int(scaled)


def constants() -> tuple[Constant, ...]:
    """Read the constants in constants.toml."""
    found = tuple(Constant(**row) for row in _load("constants.toml")["constant"])
    for constant in found:
        if not 0 <= constant.value < 1 << 8 * WIRE_BYTES[constant.wire]:
            raise ValueError(f"{constant.name} does not fit {constant.wire}")
    return found


def parameter_table() -> ParameterTable:
    """Read the parameters, the factory presets and the storage format in parameters.toml."""
    raw = _load("parameters.toml")
    parameters = []
    for row in raw["parameter"]:
        bounds = {key: _to_wire(row[key], row["decimals"]) for key in ("minimum", "maximum", "default")}
        parameter = Parameter(**{**row, **bounds})
        if not 0 <= parameter.minimum <= parameter.default <= parameter.maximum:
            raise ValueError(f"{parameter.name}: needs 0 <= minimum <= default <= maximum")
        if parameter.maximum >= 1 << 8 * WIRE_BYTES[parameter.wire]:
            raise ValueError(f"{parameter.name}: the maximum does not fit {parameter.wire}")
        if not 1 <= parameter.since <= raw["storage_format"]:
            raise ValueError(f"{parameter.name}: `since` must be a storage format, at most the current one")
        parameters.append(parameter)
    formats = [p.since for p in parameters]
    if formats != sorted(formats):
        raise ValueError("order parameters by `since`, so that an older record is a prefix of a new one")
    presets = tuple(_preset(row, parameters) for row in raw["preset"])
    return ParameterTable(raw["storage_format"], tuple(parameters), presets)


def _preset(row: dict, parameters: Sequence[Parameter]) -> Preset:
    name = row["name"]
    if unknown := row.keys() - {"name", "help", *(p.name for p in parameters)}:
        raise ValueError(f"preset {name}: no parameter {', '.join(sorted(unknown))}")
    values = tuple(_to_wire(row[p.name], p.decimals) if p.name in row else p.default for p in parameters)
    for parameter, value in zip(parameters, values, strict=True):
        if not parameter.minimum <= value <= parameter.maximum:
            raise ValueError(f"preset {name}: {parameter.name} is out of range")
    return Preset(name, row["help"], values)


def _message(row: dict) -> Message:
    fields = []
    for text in row.get("fields", []):
        match = re.fullmatch(r"(\w+): (u8|u16|u32|i16|name|set)(?:\[(\d+)\])?", text)
        if not match:
            raise ValueError(f"{row['name']}: cannot read the field {text!r}")
        fields.append(Field(match[1], match[2], int(match[3] or 1)))
    if row["kind"] not in ("open", "session", "stream"):
        raise ValueError(f"{row['name']}: unknown kind {row['kind']}")
    return Message(row["name"], row["message"], row["kind"], tuple(fields), row["help"], row.get("answer"))


def command_table() -> CommandTable:
    """Read the commands, reports, results and words in commands.toml."""
    raw = _load("commands.toml")
    commands = tuple(
        Command(row["name"], row.get("usage"), _message(row) if "message" in row else None, row["help"])
        for row in raw["command"]
    )
    reports = tuple(_message(row) for row in raw["report"])
    messages = [c.message for c in commands if c.message] + list(reports)
    if len({m.number for m in messages}) != len(messages):
        raise ValueError("two messages have the same number")
    if unknown := {m.answer for m in messages if m.answer} - {m.name for m in reports}:
        raise ValueError(f"no report is named {', '.join(sorted(unknown))}")
    results = tuple((row["name"], row["text"]) for row in raw["result"])
    version = tuple(int(part) for part in raw["firmware_version"].split("."))
    units = {fault: (unit, scale) for fault, (unit, scale) in raw["fault_units"].items()}
    if unknown := units.keys() - set(raw["words"]["Fault"]):
        raise ValueError(f"no fault is named {', '.join(sorted(unknown))}")
    return CommandTable(raw["protocol_version"], version, commands, reports, results, raw["words"], units)


def table_hash(parameters: ParameterTable, commands: CommandTable) -> int:
    """Return a 32-bit hash of everything that host and Uno must agree on."""
    agreed = {
        "parameters": [[p.name, p.wire, p.decimals, p.minimum, p.maximum] for p in parameters.parameters],
        "messages": [
            [m.name, m.number, m.kind, [[f.name, f.wire, f.count] for f in m.fields]]
            for m in [*(c.message for c in commands.commands if c.message), *commands.reports]
        ],
        "results": [name for name, _ in commands.results],
        "words": commands.words,
    }
    return int.from_bytes(hashlib.sha256(json.dumps(agreed).encode()).digest()[:4], "little")
