"""Typed, exhaustive reading of a TOML table: keys are read one by one, and unknown keys are refused."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping
from typing import Any

from .errors import DatasetError
from .layout import TABLE_FILE


class Source:
    """The text of dataset.toml, or of another `file`, kept to find line numbers for error messages. A line is given
    only if it is certain."""

    def __init__(self, text: str, trials: int, file: str = TABLE_FILE):
        self.file = file
        self._lines = text.split("\n")
        starts = [n for n, line in enumerate(self._lines, 1) if re.match(r"\s*\[\[\s*trial\s*\]\]", line)]
        bounds = itertools.pairwise([*starts, len(self._lines) + 1])
        self._trials = list(bounds) if len(starts) == trials else []

    def line(self, trial: int | None, path: tuple[str, ...]) -> int | None:
        """Return the line of the key `path` in trial number `trial` (from 1) or, if None, at the top level.

        If the key has no line of its own, the line of the innermost enclosing table is returned.
        """
        section: tuple[str, ...] = ()
        if trial is None:
            first, end = 1, len(self._lines) + 1
        elif self._trials:
            first, end = self._trials[trial - 1]
            section = ("trial",)
        else:
            return None
        wanted = (*section, *path)
        best, depth = (None, 0) if trial is None else (first, 1)
        for number in range(first, end):
            line = self._lines[number - 1]
            if header := re.match(r"\s*\[+\s*([^\]]+?)\s*\]", line):
                found = section = _keys(header[1])
            elif key := re.match(r"\s*([^=#]+?)\s*=", line):
                found = (*section, *_keys(key[1]))
            else:
                continue
            if len(found) > depth and found == wanted[: len(found)]:
                best, depth = number, len(found)
        return best


def _keys(dotted: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))


class Fields:
    """One table, read key by key; `finish` refuses the keys that were not read."""

    def __init__(self, values: Any, source: Source, trial: int | None = None, table: str | None = None):
        self._source, self._trial, self._table = source, trial, table
        if not isinstance(values, dict):
            raise self.error(None, f"must be a table, not {_kind(values)}")
        self._values = dict(values)
        self._asked: list[str] = []

    def error(self, key: str | None, problem: str) -> DatasetError:
        """Return the error for `key` of this table, with its line."""
        path = tuple(part for part in (*(self._table or "").split("."), key) if part)
        where = [".".join(path)] if path else []
        if self._trial is not None:
            where.insert(0, f"trial {self._trial}")
        line = self._source.line(self._trial, path)
        return DatasetError(problem, file=self._source.file, line=line, column=", ".join(where) or None)

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def take(self, key: str, kind: Any = object, called: str = "") -> Any:
        """Take the value of a required key, of any type or of `kind`, which messages call `called`."""
        self._asked.append(key)
        if key not in self._values:
            raise self.error(key, "the key is missing")
        value = self._values.pop(key)
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not object):
            raise self.error(key, f"must be {called}, not {_kind(value)}")
        return value

    def text(self, key: str) -> str:
        """Take a string that is not empty and has no control characters."""
        value: str = self.take(key, str, "a string")
        if not value.strip() or not value.isprintable():
            raise self.error(key, "must be printable text that is not empty")
        return value

    def choice(self, key: str, allowed: tuple[str, ...]) -> str:
        """Take one of the strings `allowed`."""
        value: str = self.take(key, str, "a string")
        if value not in allowed:
            raise self.error(key, f"{value!r} is unknown; it must be one of {', '.join(allowed)}")
        return value

    def number(self, key: str, low: float = -math.inf, high: float = math.inf) -> float:
        """Take a finite number in [low, high]."""
        value = self.take(key, int | float, "a number")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.error(key, f"must be a finite number, not {value}")
        if not low <= number <= high:
            raise self.error(key, f"{number:g} is outside {low:g} to {high:g}")
        return number

    def positive(self, key: str) -> float:
        """Take a finite number above zero."""
        value = self.number(key)
        if value <= 0:
            raise self.error(key, f"{value:g} must be above zero")
        return value

    def whole(self, key: str, low: int, high: int = 2**31 - 1) -> int:
        """Take a whole number in [low, high]."""
        value: int = self.take(key, int, "a whole number")
        if not low <= value <= high:
            raise self.error(key, f"{value} is outside {low} to {high}")
        return value

    def table(self, key: str) -> dict[str, Any]:
        """Take a nested table, unparsed."""
        value: dict[str, Any] = self.take(key, dict, "a table")
        return value

    def inner(self, key: str, values: Any) -> Fields:
        """Return `Fields` for the table `values` under `key`."""
        return Fields(values, self._source, self._trial, ".".join(filter(None, (self._table, key))))

    def completed(self, defaults: Mapping[str, Any]) -> Fields:
        """Return the keys not yet read, with `defaults` for missing ones; nested tables are completed likewise."""
        mixed = {
            key: {**defaults[key], **value}
            if isinstance(value, dict) and isinstance(defaults.get(key), dict)
            else value
            for key, value in self._values.items()
        }
        return Fields({**defaults, **mixed}, self._source, self._trial, self._table)

    def remaining(self) -> list[str]:
        """Return the keys that have not been read yet."""
        return list(self._values)

    def finish(self, also: tuple[str, ...] = ()) -> None:
        """Refuse the keys that were not read; `also` names absent optional keys for the message."""
        for key in self._values:
            allowed = ", ".join(dict.fromkeys((*self._asked, *also)))
            raise self.error(key, f"unknown key; those allowed here are {allowed}")


def _kind(value: Any) -> str:
    names = {bool: "true or false", int: "a whole number", float: "a number", str: "a string"}
    names |= {list: "a list", dict: "a table"}
    return names.get(type(value), "a date or time")
