"""A verdict in one sentence, for text and pages."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any


def own_form(effect: Mapping[str, Any]) -> str:
    """Say where an effect acts in a form other than the library's; empty if it does not."""
    _, freed, where = effect["form"].partition("freed: ")
    return f"in a form of its own: {where}" if freed else ""


def share_in_words(share: float | None) -> str:
    """Format a share of the gap (None: there is none), at most 100 %, since errors below the floor are chance."""
    return "no gap was measured" if share is None else f"{100 * min(share, 1.0):.0f} % of the gap"


def shares_in_words(nearest: Sequence[Mapping[str, Any]]) -> list[str]:
    """Format the share of the gap that each of the `nearest` explanations would close. If some have none
    and others do, there is a gap, and the former cannot predict the records on which it is measured."""
    shares = [one["share_of_gap"] for one in nearest]
    known = any(share is not None for share in shares)
    return ["could not be simulated" if share is None and known else share_in_words(share) for share in shares]


def number_in_words(value: float | None, digits: str = ".4g") -> str:
    """Format a number; a dash if it does not exist."""
    return "-" if value is None else format(value, digits)


def next_in_words(coming: Mapping[str, Any]) -> str:
    """Say which explanations the next experiment would separate; empty if no experiment is recommended."""
    if not coming["experiment"]:
        return ""
    settings = ", ".join(f"{k} {v}" for k, v in coming["settings"].items())
    return f"{coming['experiment']} ({settings}) would separate {', '.join(coming['separates'])}."


def verdict_sentence(
    verdict: str,
    effects: Sequence[Mapping[str, Any]],
    remainder: Mapping[str, Any],
    words: Callable[[Mapping[str, Any]], str] = lambda effect: effect["name"].replace("_", " "),
    nearest: Sequence[Mapping[str, Any]] = (),
) -> str:
    """State a verdict in one sentence. `words` names an effect; `nearest`: other explanations tried."""
    if verdict == "none":
        near = "to within the noise" if (remainder["times_floor"] or 0.0) <= 1.0 else "closely enough not to matter"
        return f"Nothing that matters is missing from the base model: it predicts these data {near}."
    if verdict == "unexplained":
        near_one = next((one for one in nearest if (one["share_of_gap"] or 0.0) > 0.5), None)
        if near_one:
            would = f"{' and '.join(near_one['effects'])} would close {share_in_words(near_one['share_of_gap'])}"
            return f"The base model lacks something, and no effect of the library is supported by these data: {would}."
        return "The base model lacks something that no effect of the library explains."
    names = " and ".join(words(effect) for effect in effects)
    left = remainder["share_of_gap"]
    rest = "; what is left still matters" if remainder["matters"] else "; nothing that matters is left"
    if left is None:
        return f"What the base model lacks is {names}{rest}."
    close = "which closes" if len(effects) == 1 else "which together close"
    return f"What the base model lacks is {names}, {close} {share_in_words(1 - left)}{rest}."
