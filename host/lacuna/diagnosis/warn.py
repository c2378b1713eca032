"""Reasons to doubt a fit: parameters at bounds, undetermined directions, failed predictions, impossible signs."""

from __future__ import annotations

from lacuna.diagnosis.nuisances import NuisanceOfRun, runs_of
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.residual_error import failed
from lacuna.diagnosis.score import score
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Workers
from lacuna.errors import listed
from lacuna.estimation.fit import Fit, evaluate_on
from lacuna.estimation.structure import is_learnt
from lacuna.estimation.uncertainty import Estimate, uncertainty

_NEAR_LIMIT = 3.5  # standard deviations from a nuisance's mean: it probably absorbs model error


def warnings_of(fitted: Fit, split: Split) -> tuple[str, ...]:
    """One sentence each, the most serious first."""
    known = {trial.name for trial in fitted.problem.trials}
    others = [trial for trial in split.not_fitted if trial.name not in known]
    held_out = evaluate_on(fitted, others) if others else None
    fits = [fitted, held_out] if held_out else [fitted]
    return (*_failed(fits), *_parameters(fitted), *_strayed(fits))


def _failed(fits: list[Fit]) -> list[str]:
    names = [name for fit in fits for name in failed(fit.problem.trials, fit.scaled_residuals())]
    if not names:
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
