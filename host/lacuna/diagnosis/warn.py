"""Reasons to doubt a fit: parameters at bounds, undetermined directions, failed predictions."""

from __future__ import annotations

from lacuna.check.numbers import listed
from lacuna.diagnosis.residual_error import failed
from lacuna.diagnosis.split import Split
from lacuna.estimation.fit import Fit, evaluate_on
from lacuna.estimation.structure import is_learnt
from lacuna.estimation.uncertainty import uncertainty

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
        f"{e.name} is at its bound ({_quantity(told(e.name, e.value), e.unit)}): widen it if it is no physical limit."
        for e in known.estimates
        if e.at_bound
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
    far: dict[str, list[str]] = {}
    for fit in fits:
        for trial, values, parameters in zip(
            fit.problem.trials, fit.solution.point.nuisances, fit.problem.nuisances, strict=True
        ):
            for value, parameter in zip(values, parameters, strict=True):
                if "." not in parameter.name and abs(value - parameter.value) > _NEAR_LIMIT * parameter.step_scale:
                    far.setdefault(parameter.name, []).append(trial.name)
    return [
        f"{name} is more than {_NEAR_LIMIT:g} standard deviations from what is expected in {listed(trials)}: it"
        " probably absorbs model error."
        for name, trials in far.items()
    ]


def _combined(names: list[str]) -> str:
    return listed(names) if len(names) == 1 else f"a combination of {listed(names)}"


def _quantity(value: float, unit: str) -> str:
    return f"{value:.4g} {unit}".rstrip()
