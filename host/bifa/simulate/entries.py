"""The compiled functions that Python calls, with an on-disk cache that is invalidated by a change in any source.

The only file with a numba cache is generated. It holds a wrapper for each function, and its name contains the hash of
all compiled sources of the simulator and the effects.
"""

import inspect
from pathlib import Path

from bifa import effects
from bifa.simulate import generated, hooks, locomotion, stand

_ENTRIES = (locomotion.walk_record, stand.step_record, stand.static_record, stand.anchor_record)
# Modules without compiled code: a change there needs no recompilation.
_PLAIN = {"__init__", "entries", "gaits", "generated", "paper", "passing", "records", "rigs", "tables", "terrain"}


def sources() -> list[str]:
    """Source texts of the simulator, of every effect (wherever its file is) and of the chains of hooks."""
    paths = [path for path in sorted(Path(__file__).parent.glob("*.py")) if path.stem not in _PLAIN]
    own = [path.read_text("utf-8") for path in paths]
    return [*own, *(inspect.getsource(module) for module in effects.modules().values()), hooks.chain_source()]


def entry_source() -> str:
    lines = [f'"""Generated; sources {generated.digest(*sources())}."""', "from numba import njit"]
    lines += [f"from {entry.__module__} import {entry.__name__} as _{entry.__name__}" for entry in _ENTRIES]
    for entry in _ENTRIES:
        arguments = ", ".join(inspect.signature(entry).parameters)
        lines += ["", "", '@njit(cache=True, nogil=True, error_model="numpy")']
        lines += [f"def {entry.__name__}({arguments}):", f"    return _{entry.__name__}({arguments})"]
    return "\n".join(lines) + "\n"


entries = generated.load("entries", entry_source())
