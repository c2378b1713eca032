"""The compiled functions that Python calls, with an on-disk cache that notices a change of any source.

The one file with a cache is generated: three lines a function, and in its name the hash of all compiled sources of the
simulator and of the effects.
"""

from __future__ import annotations

import inspect
from importlib import import_module
from pathlib import Path

from bifa import effects
from bifa.simulate import generated, hooks

_ENTRIES = {
    "walk_record": "locomotion",
    "progress_record": "locomotion",
    "step_record": "stand",
    "static_record": "stand",
    "anchor_record": "stand",
}


# Never compiled: a change there needs no new compilation.
_PLAIN = {
    "__init__.py",
    "entries.py",
    "gaits.py",
    "learnt_curves.py",
    "paper.py",
    "passing.py",
    "records.py",
    "rigs.py",
    "tables.py",
    "terrain.py",
}


def sources() -> list[str]:
    """Of the simulator, of every effect wherever its file lies, and of the chains that join them."""
    paths = [path for path in sorted(Path(__file__).parent.glob("*.py")) if path.name not in _PLAIN]
    own = [path.read_text("utf-8") for path in paths]
    return [*own, *(inspect.getsource(module) for module in effects.modules().values()), hooks.chain_source()]


def entry_source() -> str:
    lines = [f'"""Generated; sources {generated.digest(*sources())}."""', "from numba import njit"]
    for name, module in _ENTRIES.items():
        lines.append(f"from bifa.simulate.{module} import {name} as _{name}")
    for name, module in _ENTRIES.items():
        arguments = ", ".join(_arguments(module, name))
        lines += ["", "", '@njit(cache=True, nogil=True, error_model="numpy")']
        lines += [f"def {name}({arguments}):", f"    return _{name}({arguments})"]
    return "\n".join(lines) + "\n"


def _arguments(module: str, name: str) -> list[str]:
    function = getattr(import_module(f"bifa.simulate.{module}"), name)
    return list(inspect.signature(function.py_func).parameters)


entries = generated.load("entries", entry_source())
