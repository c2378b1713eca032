"""The bench's file (TOML): masses, supply and vacuum, which are asked for once, and how the lab's instruments write
their files, which `bifa instrument` proposes.

```toml
[known]
head_mass_kg = 0.182

[instrument.machine]
preset = "bluehill"
```
"""

import time
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import tomli_w

from bifa.data.export import Export, parse_exports
from bifa.data.fields import Fields, Source
from bifa.errors import BifaError
from bifa.files import read_text, write_text
from bifa.measure.desk import Desk
from bifa.robot.parameters import BASE_PARAMETERS, ModelParameterError
from bifa.toml import parse_toml

QUESTIONS = {
    "head_mass_kg": "mass of the head half, in kg",
    "tail_mass_kg": "mass of the tail half, in kg",
    "supply_positive_psi": "positive supply at the valves, gauged, in psi",
    "supply_negative_psi": "vacuum at the valves, gauged, in psi (negative)",
}
_LOOK_S = 0.1
_TABLES = {"known", "instrument"}


class BenchFileError(BifaError):
    """The bench's file cannot be used; the text says why."""


def _read(path: Path) -> tuple[dict[str, Any], str]:
    try:
        text = read_text(path)
        document = parse_toml(text)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise BenchFileError(f"cannot read the bench's file {path}: {error}") from None
    if set(document) - _TABLES or not all(isinstance(table, dict) for table in document.values()):
        raise BenchFileError(
            f"{path}: a bench's file may have the tables [known], [instrument.machine] and "
            f"[instrument.camera]; this one has {', '.join(document)}"
        )
    return document, text


def read_exports(path: Path) -> dict[str, Export]:
    """Return the declarations of the instruments' files under "machine" and "camera"; empty if `path` does not exist.
    Raises DatasetError, with the line, for an invalid declaration."""
    if not path.exists():
        return {}
    document, text = _read(path)
    return parse_exports(Fields(document.get("instrument", {}), Source(text, 0, str(path)), table="instrument"))


def read_bench(path: Path) -> dict[str, float]:
    """Return the known values in the file. Raises BenchFileError if it cannot be read or a value is unknown or out of
    bounds."""
    document, _ = _read(path)
    try:
        return parse_known(f"{name}={value}" for name, value in document.get("known", {}).items())
    except ModelParameterError as error:
        raise BenchFileError(f"{path}: {error}") from None


def load_or_ask_known(path: Path, desk: Desk) -> dict[str, float]:
    """Return the known values of the bench; if its file does not have them, ask at the desk and write them to it."""
    if path.exists() and "known" in _read(path)[0]:
        return read_bench(path)
    desk.say(f"Which of these have you measured directly? You are asked once; the answers are kept in {path}.")
    known: dict[str, float] = {}
    try:
        for name, meaning in QUESTIONS.items():
            known |= _ask(desk, name, meaning)
    finally:
        desk.clear()
    add_table(path, tomli_w.dumps({"known": known}))
    desk.say(f"Saved in {path}; edit that file to correct a value.")
    return known


def add_table(path: Path, table: str) -> None:
    """Append a table (TOML) to the file, which keeps what else it has; it is created if needed. Raises BenchFileError
    if that gives no valid file."""
    before = _read(path)[1].rstrip() if path.exists() else ""
    text = f"{before}\n\n{table}" if before else table
    try:
        parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise BenchFileError(
            f"{path}: this cannot be appended ({error}); write it into the file yourself:\n{table}"
        ) from None
    write_text(path, text)


def _ask(desk: Desk, name: str, meaning: str) -> dict[str, float]:
    while True:
        desk.ask("known", f"{name}: {meaning}? Enter: not measured.", {"name": name})
        while (answer := desk.answer()) is None:
            time.sleep(_LOOK_S)
        if not answer:
            return {}
        try:
            return parse_known([f"{name}={answer}"])
        except ModelParameterError as error:
            desk.say(str(error))


def parse_known(given: Iterable[str]) -> dict[str, float]:
    """Parse `NAME=VALUE` texts as a person types them. Raises ModelParameterError for an unknown name or a value out
    of bounds."""
    known = {}
    for text in given:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise ModelParameterError(f"{text!r}: write it as NAME=VALUE, for example head_mass_kg=0.182")
        if name not in BASE_PARAMETERS:
            raise ModelParameterError(f"the model has no parameter {name!r}; it has {', '.join(BASE_PARAMETERS)}")
        try:
            known[name] = float(value)
        except ValueError:
            raise ModelParameterError(f"{name} must be a number, not {value!r}") from None
        BASE_PARAMETERS[name].check(known[name])
    return known
