"""What speaks against a verdict, though it stands, or against its fit: one sentence each."""

from __future__ import annotations

from collections.abc import Sequence

from lacuna.diagnosis.decide import Choice
from lacuna.diagnosis.nuisances import Followed, NuisanceOfRun, runs_of
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.residual_error import Error, Floor, failed, with_residuals
from lacuna.diagnosis.score import score
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Workers
from lacuna.errors import listed
from lacuna.estimation.fit import Fit, evaluate_on
from lacuna.estimation.structure import is_learnt
from lacuna.estimation.uncertainty import Estimate, pieces_of, uncertainty

_SURELY = 4.0  # standard deviations
_APART = 3.0  # times the noise: what is left of repeats hardly differs by as much, unless their predictions do
_NEAR_LIMIT = 3.5  # standard deviations from a nuisance's mean: it probably absorbs model error


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


def warnings_of(fitted: Fit, split: Split) -> tuple[str, ...]:
    """Reasons to doubt a fit, the most serious first: what it fails to predict, parameters, nuisances."""
    known = {trial.name for trial in fitted.problem.trials}
    others = [trial for trial in split.not_fitted if trial.name not in known]
    held_out = evaluate_on(fitted, others) if others else None
    fits = [fitted, held_out] if held_out else [fitted]
    return (*_failed(fits), *_parameters(fitted), *_strayed(fits))


def _failed(fits: list[Fit]) -> list[str]:
    if not (names := failed(with_residuals(fits))):
        return []
    return [
        f"The model could not predict {listed(names)}: counted as badly predicted where explanations are compared, left"
        " out of the errors."
    ]


def _parameters(fitted: Fit) -> list[str]:
    known = uncertainty(fitted)
    told = fitted.structure.system.told
    found = [
        f"{e.name} is at its bound ({_quantity(told(e.name, _bound(fitted, e)), e.unit)}): widen it if it is no"
        " physical limit."
        for e in known.estimates
        if e.at_bound and e.determined
    ]
    found += [
        f"{e.name} = {_quantity(told(e.name, e.value), e.unit)} lies outside its plausible range."
        for e in known.estimates
        if e.implausible and not e.at_bound
    ]
    # between its data a learnt curve is what its prior makes of it, in any number of directions
    own = [[name for name in direction if not is_learnt(name)] for direction in known.undetermined]
    found += [f"The data hardly determine {_combined(names)}." for names in own if names]
    return list(dict.fromkeys(found))


def _strayed(fits: list[Fit]) -> list[str]:
    """Nuisances far from what is expected, in single trials or, by less, in all of them."""
    runs: dict[str, list[NuisanceOfRun]] = {}
    for run in runs_of(fits):
        runs.setdefault(run.nuisance.name, []).append(run)
    found = []
    for name, each in runs.items():
        if far := [one.trial.name for one in each if abs(one.away) > _NEAR_LIMIT]:
            found.append(
                f"{name} is more than {_NEAR_LIMIT:g} standard deviations from what is expected in {listed(far)}: it"
                " probably absorbs model error."
            )
        if abs(sum(one.away for one in each)) > _NEAR_LIMIT * len(each) ** 0.5:
            mean = sum(one.value for one in each) / len(each)
            expected = sum(one.nuisance.value for one in each) / len(each)
            unit = each[0].nuisance.unit
            found.append(
                f"{name} is {_quantity(mean, unit)} on average over {len(each)} trials, where"
                f" {_quantity(expected, unit)} is expected: declare that, or other runs are predicted worse."
            )
    return found


def impossible_signs(fitted: Fit, policy: Policy) -> list[str]:
    """A sentence for each effect with one size, absent at a bound, that the residual of `fitted` would push beyond that
    bound: if to first order it removes more than the policy's share of the residual."""
    if fitted.structure.sites:  # nothing is grown on a learnt curve
        return []
    system, found = fitted.structure.system, []
    able = [
        name
        for name, e in system.effects.items()
        if name not in fitted.structure.effects
        and e.sizes == 1
        and e.absent in (e.parameters[0].lower, e.parameters[0].upper)
    ]
    for one in score(fitted, able, Workers(lambda _: None)).screened() if able else ():
        if one.wrong_sign > policy.share:
            effect = system.effects[one.effect]
            size = effect.parameters[0]
            told, typical = (system.told(effect.full_name(size), value) for value in (effect.absent, size.value))
            side, bound = "below" if told < typical else "above", f"{told:g} {size.unit}".rstrip()
            found.append(f"{one.effect} would fit with a {size.name} {side} {bound}, which its bounds forbid.")
    return found


def _bound(fitted: Fit, at: Estimate) -> float:
    """The bound that stopped it; where that is another parameter, the value."""
    parameter = fitted.structure.parameters[fitted.structure.names.index(at.name)]
    if parameter.at_least:
        return at.value
    return min((parameter.lower, parameter.upper), key=lambda bound: abs(at.value - bound))


def _combined(names: list[str]) -> str:
    return listed(names) if len(names) == 1 else f"a combination of {listed(names)}"


def _quantity(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip()
