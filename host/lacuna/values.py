"""Named parameter values as a model function reads them."""

from __future__ import annotations

from functools import cache
from typing import Any
from unicodedata import normalize

import numpy as np


def plain(value: Any) -> Any:
    """Convert NumPy scalars and arrays to plain Python objects; return anything else as it is."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


@cache
def _as_identifier(name: str) -> str:
    """The form to which Python normalises an identifier in source code."""
    return normalize("NFKC", name)


class Values(dict[str, Any]):
    """A dict whose entries are also attributes: `theta["mass_kg"]` is `theta.mass_kg`, `theta["coulomb.force_N"]` is
    `theta.coulomb.force_N`. Entries are in the order of their declaration. Python normalises what follows a dot (the
    micro sign becomes a Greek letter), so attributes are sought in that form."""

    def __getattr__(self, name: str) -> Any:
        if name in self:
            return self[name]
        if name.startswith("__"):  # looked up by copy and pickle
            raise AttributeError(name)
        members = dict[str, Any]()
        for key, value in self.items():
            first, _, rest = key.partition(".")
            if _as_identifier(first) == name:
                if not rest:
                    return value
                members[rest] = value
        if not members:
            raise AttributeError(f"{name}: there are {', '.join(self)}")
        return Values(members)

    def __missing__(self, name: str) -> Any:
        raise KeyError(f"{name}: there are {', '.join(self)}")

    def with_attributes(self) -> Values:
        """Return a copy with its entries as plain attributes, which are faster to read in loops over samples."""
        found, parts = Values(self), dict[str, Values]()
        for name, value in self.items():
            owner, _, own = name.rpartition(".")
            part = parts.setdefault(_as_identifier(owner), Values()) if owner else found
            part[own] = vars(part)[_as_identifier(own)] = value
        vars(found).update(parts)
        return found
