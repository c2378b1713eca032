"""What speaks against a verdict, though it stands: one sentence each."""

from __future__ import annotations

from collections.abc import Sequence

from lacuna.diagnosis.decide import Choice
from lacuna.diagnosis.nuisances import Followed
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.residual_error import Error, Floor
from lacuna.diagnosis.split import Split
from lacuna.errors import listed
from lacuna.estimation.fit import Fit
from lacuna.estimation.uncertainty import pieces_of

_SURELY = 4.0  # standard deviations
_APART = 3.0  # times the noise: what is left of repeats hardly differs by as much, unless their predictions do


def not_predicted(found: Fit, split: Split, error: Error, floor: Floor, policy: Policy) -> list[str]:
    """Of a verdict that nothing is missing: records that were not fitted, and are predicted worse than that beyond
    chance."""
    pieces = sum(pieces_of(trial, found.problem.floor) for trial in split.final)
    above = error.held_out**2 - floor.held_out**2 if split.final else 0.0
    if above <= policy.relevance * floor.held_out**2 or above < _SURELY * floor.held_out**2 * (2.0 / pieces) ** 0.5:
        return []
    return [
        f"Records that were not fitted ({listed([trial.name for trial in split.final])}) are predicted to"
        f" {error.held_out:.2f} times the noise, those fitted to {error.fitted:.2f}: something may be missing there."
    ]


def repeats_apart(floor: Floor) -> list[str]:
    """Of repeats that were measured alike and are predicted differently: what they differ by is taken for noise, and
    hides what is missing."""
    most = max(floor.fitted, floor.held_out)
    if not most > _APART:
        return []
    return [
        f"What the model leaves of one repeat differs from what it leaves of another by {most:.3g} times the noise, and"
        " what repeats differ by passes for noise: was one recorded otherwise, or does the model count samples where"
        " times differ?"
    ]


def but_too_little(choice: Choice, split: Split, tested: float | None, policy: Policy) -> list[str]:
    """Of a choice that predicts better, and is still not named. `tested`: what it closes on the final trials."""
    named = " and ".join(choice.candidate.effects)
    if tested is not None and tested < policy.half:
        final = listed([trial.name for trial in split.final])
        how = "worse than without" if tested < 0.0 else f"by only {100 * tested:.0f} % of what is missing there"
        return [
            f"With {named} most records are predicted better, but those that chose nothing ({final}) {how}: it is not"
            " named. Do they differ in something that is not told?"
        ]
    return [f"{named}: a better prediction beyond doubt, but too little of what is missing to be named."]


def doubts(choice: Choice, split: Split, tested: float | None) -> list[str]:
    """Of named effects: an explanation of more weight, and final trials that tell little. `tested`: what the
    effects close there, if there is a gap."""
    said = []
    likeliest, weight = max(choice.weights.items(), key=lambda found: found[1])
    if weight > 0.5 and frozenset(likeliest) > frozenset(choice.candidate.effects):
        further = [effect for effect in likeliest if effect not in choice.candidate.effects]
        said.append(
            f"With {listed(further)}, too, the explanation would have more weight ({weight:.2f}), but that closes too"
            " little of what is left to be named, or helps too little where nothing was fitted."
        )
    if tested is not None and len(split.final) == 1:
        said.append(f"One record alone informed no choice, {split.final[0].name}: the shares of the gap rest on it.")
    return said


def perhaps_absent(names: Sequence[str]) -> list[str]:
    """Of named effects with an interval that says little."""
    return [
        f"The interval of {name} holds the size at which it is absent: conditions disagree about how large it is,"
        " though without it what was not fitted is predicted worse."
        for name in names
    ]


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
