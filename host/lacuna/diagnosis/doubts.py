"""What speaks against a verdict, though it stands: one sentence each."""

from __future__ import annotations

from collections.abc import Sequence

from lacuna.check.numbers import listed
from lacuna.diagnosis.decide import Choice
from lacuna.diagnosis.named import Named
from lacuna.diagnosis.nuisances import Followed
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.residual_error import Error, Floor
from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import Fit
from lacuna.estimation.uncertainty import pieces_of

_HARMFUL = 0.01  # of the gap: a share below zero by less is rounding
_SURELY = 4.0  # standard deviations


def not_foreseen(found: Fit, split: Split, error: Error, floor: Floor, policy: Policy) -> list[str]:
    """Of a verdict that nothing is missing: records that were not fitted, and are predicted worse than that beyond
    chance."""
    pieces = sum(pieces_of(trial, found.problem.floor) for trial in split.held_out)
    above = error.held_out**2 - floor.held_out**2 if split.held_out else 0.0
    if above <= policy.relevance * floor.held_out**2 or above < _SURELY * floor.held_out**2 * (2.0 / pieces) ** 0.5:
        return []
    return [
        f"Records that were not fitted ({listed([trial.name for trial in split.held_out])}) are predicted to"
        f" {error.held_out:.2f} times the noise, those fitted to {error.fitted:.2f}: something may be missing there."
    ]


def but_too_little(choice: Choice) -> list[str]:
    """Of a choice that is supported, and still not named."""
    named = " and ".join(choice.candidate.effects)
    return [f"{named}: a better prediction beyond doubt, but too little of what is missing to be named."]


def doubts(choice: Choice, split: Split, effects: Sequence[Named], gap: tuple[Error, Error, Floor] | None) -> list[str]:
    """Of named `effects`: an explanation that is more probable; or, since the final trials inform no choice, effects
    with which these are predicted worse. `gap`: errors before and with them, and the floor, if there is a gap at all.
    """
    said = _harmful(choice, effects, *gap) if gap else []
    likeliest, weight = max(choice.weights.items(), key=lambda found: found[1])
    if weight > 0.5 and frozenset(likeliest) > frozenset(choice.candidate.effects):
        besides = [effect for effect in likeliest if effect not in choice.candidate.effects]
        said.append(
            f"With {listed(besides)}, too, the explanation would be more probable ({weight:.2f}), but that closes too"
            " little of what is left to be named, or helps too little where nothing was fitted."
        )
    if gap and len(split.held_out) == 1:
        said.append(f"One record alone was not fitted, {split.held_out[0].name}: the shares of the gap rest on it.")
    return said


def _harmful(choice: Choice, effects: Sequence[Named], before: Error, explained: Error, floor: Floor) -> list[str]:
    worse = [e.name for e in effects if e.share_of_gap < -_HARMFUL]
    if explained.held_out > before.held_out:
        named = " and ".join(choice.candidate.effects)
        return [f"With {named} the records that were not fitted are predicted worse than without: doubt the verdict."]
    if before.held_out > floor.held_out and worse:
        return [f"With {listed(worse)} the records that were not fitted are predicted worse than without: doubt it."]
    return []


def follow_in_words(followed: Sequence[Followed]) -> str:
    """Nuisances that follow the condition, as a clause."""
    each = [f"{100 * one.share:.0f} % of the variance of {one.nuisance}" for one in followed]
    return f"{listed(each)} {'is' if len(each) == 1 else 'are'} between conditions"


def followed_by_nothing(followed: Sequence[Followed]) -> list[str]:
    """A caution where nuisances follow the condition and nothing explains it."""
    if not followed:
        return []
    names = listed([one.nuisance for one in followed])
    return [
        f"{follow_in_words(followed)}, though runs of one differ. If no condition sets {names}, the model lacks"
        " something that acts like it."
    ]
