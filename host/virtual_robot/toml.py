# SPDX-License-Identifier: GPL-3.0-or-later
"""The little TOML that is written here: numbers, strings, tables, arrays of tables with inline tables in them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def dumps(document: Mapping[str, Any]) -> str:
    """Plain values first, then tables, then arrays of tables."""
    lines: list[str] = []
    _table(lines, (), document)
    return "\n".join(lines).strip() + "\n"


def _table(lines: list[str], path: tuple[str, ...], table: Mapping[str, Any]) -> None:
    lines += [f"{key} = {_value(value)}" for key, value in table.items() if not _is_table(value)]
    for key, value in table.items():
        here = (*path, key)
        if isinstance(value, Mapping):
            lines += ["", f"[{'.'.join(here)}]"]
            _table(lines, here, value)
        elif _is_table(value):
            for item in value:
                lines += ["", f"[[{'.'.join(here)}]]"]
                lines += [f"{name} = {_value(inner)}" for name, inner in item.items()]


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping) or (isinstance(value, list) and bool(value) and isinstance(value[0], Mapping))


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, (bool, str)):
        return json.dumps(value)
    return repr(float(value)) if isinstance(value, float) else str(int(value))
