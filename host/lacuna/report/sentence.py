"""A verdict in one sentence, wherever it is told."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any


def in_words(effect: Mapping[str, Any]) -> str:
    """The effect's name as it is, with spaces."""
    return effect["name"].replace("_", " ")


def own_form(effect: Mapping[str, Any]) -> str:
    """Where it acts in another form than the library's; empty if it does not."""
    _, freed, where = effect["form"].partition("freed: ")
    return f"in a form of its own: {where}" if freed else ""


def verdict_sentence(
    verdict: str,
    effects: Sequence[Mapping[str, Any]],
    remainder: Mapping[str, Any],
    words: Callable[[Mapping[str, Any]], str] = in_words,
) -> str:
    """A verdict (of `as_record`) in one sentence; `words`: what an effect is called."""
    if verdict == "none":
        return "Nothing that matters is missing from the base model: it predicts these data to within the noise."
    if verdict == "unexplained":
        return "The base model lacks something that no effect of the library explains."
    names = " and ".join(words(effect) for effect in effects)
    closed = f"{100 * (1 - remainder['share_of_gap']):.0f} % of the gap"
    rest = "; what is left still matters" if remainder["matters"] else "; nothing that matters is left"
    return f"What the base model lacks is {names}, which closes {closed}{rest}."
