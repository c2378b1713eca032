"""What a lab knows of its bench, asked for once and kept in a file (TOML): masses, supply, vacuum.

```toml
[known]
head_mass_kg = 0.182
```
"""

from __future__ import annotations

import time
import tomllib
from pathlib import Path

import tomli_w

from bifa.errors import BifaError
from bifa.files import write_text
from bifa.measure.desk import Desk
from bifa.measure.known import parse_known
from bifa.robot.parameters import ModelParameterError
from bifa.toml import parse_toml

ASKED = {
    "head_mass_kg": "mass of the head half, in kg",
    "tail_mass_kg": "mass of the tail half, in kg",
    "supply_positive_psi": "positive supply at the valves, gauged, in psi",
    "supply_negative_psi": "vacuum at the valves, gauged, in psi (negative)",
}
_LOOK_S = 0.1


class BenchFileError(BifaError):
    """The bench's file cannot be used; the text says why."""


def read_bench(path: Path) -> dict[str, float]:
    """The known values in the file. BenchFileError where it cannot be read or a value is unknown or out of bounds."""
    try:
        document = parse_toml(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise BenchFileError(f"cannot read the bench's file {path}: {error}") from None
    if set(document) - {"known"} or not isinstance(document.get("known", {}), dict):
        raise BenchFileError(f"{path}: a bench's file has one table, [known]; it has {', '.join(document)}")
    try:
        return parse_known(f"{name}={value}" for name, value in document.get("known", {}).items())
    except ModelParameterError as error:
        raise BenchFileError(f"{path}: {error}") from None


def known_on(path: Path, desk: Desk) -> dict[str, float]:
    """The known values of the bench; where its file does not exist they are asked for at the desk, and written."""
    if path.exists():
        return read_bench(path)
    desk.say(f"Which of these have you measured directly? You are asked once; the answers are kept in {path}.")
    known: dict[str, float] = {}
    try:
        for name, meaning in ASKED.items():
            known |= _asked(desk, name, meaning)
    finally:
        desk.clear()
    write_text(path, tomli_w.dumps({"known": known}))
    desk.say(f"Saved in {path}; edit that file to correct a value.")
    return known


def _asked(desk: Desk, name: str, meaning: str) -> dict[str, float]:
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
