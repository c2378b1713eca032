"""Reads the tables of this folder and checks that they make sense."""

import hashlib
import json
import re
import tomllib
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
    """What travels in one frame; `fields` follow the number of the message and its sequence number.

    `answer`: the report that answers it, where that is not "done".
    """

    name: str
    number: int
    kind: str
    fields: tuple[Field, ...]
    help: str
    answer: str | None = None

    def size(self, set_size: int) -> int:
        """Bytes of all fields."""
        widths = {**WIRE_BYTES, "name": NAME_BYTES, "set": set_size}
        return sum(widths[f.wire] * f.count for f in self.fields)


@dataclass(frozen=True)
class Command:
    """A command; `usage` is its form on the console, `message` that in a frame; either may be None."""

    name: str
    usage: str | None
    message: Message | None
    help: str

    def words(self) -> tuple[int, int]:
        """Least and most words of the line, the command itself included: what stands in brackets may be left out."""
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


@dataclass(frozen=True)
class Constant:
    """A number of the firmware's that the host has to know."""

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
    """The constants of constants.toml."""
    found = tuple(Constant(**row) for row in _load("constants.toml")["constant"])
    for constant in found:
        if not 0 <= constant.value < 1 << 8 * WIRE_BYTES[constant.wire]:
            raise ValueError(f"{constant.name} does not fit {constant.wire}")
    return found


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
    formats = [p.since for p in parameters]
    if formats != sorted(formats):
        raise ValueError("new parameters go at the end, so that an older record is the beginning of a new one")
    presets = [
        Preset(
            row["name"],
            row["help"],
            tuple(_to_wire(row[p.name], p.decimals) if p.name in row else p.default for p in parameters),
        )
        for row in raw["preset"]
    ]
    return ParameterTable(raw["storage_format"], tuple(parameters), tuple(presets))


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
    """Commands, reports and results of commands.toml."""
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
        raise ValueError(f"no report is called {', '.join(sorted(unknown))}")
    results = tuple((row["name"], row["text"]) for row in raw["result"])
    version = tuple(int(part) for part in raw["firmware_version"].split("."))
    return CommandTable(raw["protocol_version"], version, commands, reports, results, raw["words"])


def table_hash(parameters: ParameterTable, commands: CommandTable) -> int:
    """32 bits that change whenever anything changes that the two ends must agree on."""
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
