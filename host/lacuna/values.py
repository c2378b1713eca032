"""Named parameter values as a model function reads them."""

from __future__ import annotations

from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """Convert NumPy scalars and arrays to plain Python objects; return anything else as it is."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


class Values(dict[str, Any]):
    """A dict whose entries are also attributes: `theta["mass_kg"]` is `theta.mass_kg`, `theta["coulomb.force_N"]` is
    `theta.coulomb.force_N`. Entries are in the order of their declaration."""

    def __getattr__(self, name: str) -> Any:
        if name in self:
            return self[name]
        if name.startswith("__"):  # looked up by copy and pickle
            raise AttributeError(name)
        members = {key[len(name) + 1 :]: value for key, value in self.items() if key.startswith(f"{name}.")}
        if not members:
            raise AttributeError(f"{name}: there are {', '.join(self)}")
        return Values(members)

    def with_attributes(self) -> Values:
        """Return a copy with its entries as plain attributes, which are faster to read in loops over samples."""
        found, parts = Values(self), dict[str, Values]()
        for name, value in self.items():
            owner, _, own = name.rpartition(".")
            part = parts.setdefault(owner, Values()) if owner else found
            part[own] = vars(part)[own] = value
        vars(found).update(parts)
        return found
