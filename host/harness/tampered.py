"""Documents as people corrupt them: one value, anywhere, is changed, removed or added."""

import copy
from typing import Any

from hypothesis import strategies as st

JUNK: list[Any] = [0, -1, 3, -0.5, 1e-320, 10**30, float("nan"), float("inf"), True, "", "x", "../x", "a\nb", "\x1b[0m"]
JUNK += [[], [[]], [{}], [1, [2]], ["a", "b"], {}, {"a": 1}, {"a": {"b": 1}}]


@st.composite
def tampered(draw: st.DrawFn, document: dict[str, Any]) -> dict[str, Any]:
    """A copy of `document` (dicts and lists) with a single change."""
    spoilt = copy.deepcopy(document)
    place = draw(st.sampled_from(_places(spoilt)))
    how = draw(st.sampled_from(("other", "other", "gone", "new")))
    *way, last = place
    table = spoilt
    for key in way:
        table = table[key]
    if how == "gone":
        del table[last]
    elif how == "new" and isinstance(table, dict):
        table["new key"] = draw(st.sampled_from(JUNK))
    else:
        table[last] = draw(st.sampled_from(JUNK))
    return spoilt


def _places(node: Any, way: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The path of keys to every value within; of a list, only the first and last elements."""
    if isinstance(node, dict):
        keys: list[Any] = list(node)
    else:
        keys = sorted({0, len(node) - 1}) if isinstance(node, list) and node else []
    return [place for key in keys for place in [(*way, key), *_places(node[key], (*way, key))]]
