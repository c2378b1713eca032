"""Warnings: reasons to doubt a verdict or its fit, each in a sentence or two."""

from collections.abc import Sequence

import numpy as np

from lacuna.diagnosis.decide import Choice
from lacuna.diagnosis.nuisances import Followed, NuisanceOfRun, runs_of
from lacuna.diagnosis.policy import Policy
from lacuna.diagnosis.residual_error import Error, Floor, failed, with_residuals
from lacuna.diagnosis.score import Promise, score
from lacuna.diagnosis.split import Split
from lacuna.diagnosis.workers import Workers
from lacuna.errors import listed
from lacuna.estimation.fit import Fit, evaluate_on
from lacuna.estimation.problem import LARGEST_STEP, Point, Problem, in_parallel
from lacuna.estimation.structure import is_learnt
from lacuna.estimation.uncertainty import Estimate, pieces_of, uncertainty
from lacuna.system import misshapen

_MIN_Z = 4.0  # standard deviations
_MAX_REPEAT_RATIO = 3.0  # times the noise: residuals of repeats hardly differ by as much unless their predictions do
_NEAR_LIMIT = 3.5  # standard deviations from its mean beyond which a nuisance probably absorbs model error
_MAX_SPREAD = 2.0  # standard deviations of a nuisance between trials beyond which its declared one is doubted


def not_predicted(found: Fit, split: Split, error: Error, floor: Floor, policy: Policy) -> list[str]:
    """For the verdict `none`: a warning if held-out records are predicted significantly worse than the noise."""
    pieces = sum(pieces_of(trial, found.problem.floor) for trial in split.final)
    noise = max(floor.held_out, 1.0)  # repeats may differ by less than the declared noise, or than rounding
    above = (error.held_out**2 - floor.held_out**2) / noise**2 if split.final else 0.0
    if above <= policy.relevance or above < _MIN_Z * (2.0 / pieces) ** 0.5:
        return []
    return [
        f"The test records ({listed([trial.name for trial in split.final])}) are predicted with an error of"
        f" {error.held_out:.2f} times the noise, fitted ones with {error.fitted:.2f}: something may be missing there."
    ]


def repeats_apart(floor: Floor) -> list[str]:
    """A warning if residuals of repeats differ far more than the noise, which happens when repeats measured alike are
    predicted differently: the difference is taken for noise and hides what is missing."""
    most = max(floor.fitted, floor.held_out)
    if not most > _MAX_REPEAT_RATIO:
        return []
    return [
        f"Residuals of repeats differ by {most:.3g} times the noise, and what repeats differ by is taken for noise: was"
        " one of them recorded differently, or does the model count samples although sampling times differ?"
    ]


def explains_too_little(choice: Choice, split: Split, tested: float | None, policy: Policy) -> list[str]:
    """A warning for effects that predict better and are not named. `tested`: see `Assessment`."""
    named = " and ".join(choice.candidate.effects)
    if tested is not None and tested < policy.half:
        final = listed([trial.name for trial in split.final])
        how = "get worse" if tested < 0.0 else f"improve by only {100 * tested:.0f} % of what is missing there"
        return [
            f"With {named} most records are predicted better, but the test records ({final}) {how}: it is not named."
            " Do these records differ in some setting that was not declared?"
        ]
    return [f"{named} predicts better beyond doubt, but explains too little of what is missing to be named."]


def doubts(choice: Choice, split: Split, tested: float | None) -> list[str]:
    """Warnings for named effects: a larger explanation has more weight, or there are fewer than two final trials.
    `tested`: the share of the gap that the effects close on the final trials; None without a gap."""
    said = []
    likeliest, weight = max(choice.weights.items(), key=lambda found: found[1])
    if weight > 0.5 and frozenset(likeliest) > frozenset(choice.candidate.effects):
        further = [effect for effect in likeliest if effect not in choice.candidate.effects]
        said.append(
            f"With {listed(further)} added the explanation would have more weight ({weight:.2f}), but that closes too"
            " little of what is left to be named, or helps too little on records that were not fitted."
        )
    if not split.final:
        said.append("No record was left to test these effects: with further records, or repeats, some would be.")
    if tested is not None and len(split.final) == 1:
        said.append(f"The shares of the gap rest on a single test record, {split.final[0].name}.")
    return said


def perhaps_absent(names: Sequence[str]) -> list[str]:
    """Warnings for named effects whose interval contains the size at which they are absent."""
    return [
        f"The interval of {name} contains the size at which it is absent: its size is hardly known, though without it"
        " records that were not fitted are predicted worse."
        for name in names
    ]


def stopped_by_bounds(fitted: Fit) -> set[str]:
    """Effects with a size at a bound other than the size at which they are absent, of which another warning tells."""
    at = {e.name: _bound(fitted, e) for e in uncertainty(fitted).estimates if e.at_bound and e.determined}
    effects = (fitted.structure.system.effects[name] for name in fitted.structure.effects)
    return {e.name for e in effects if any(at.get(size, e.absent) != e.absent for size in e.size_names)}


def follow_in_words(followed: Sequence[Followed]) -> str:
    """Nuisances that follow the condition, as a clause."""
    each = [f"{100 * one.share:.0f} % of the variance of {one.nuisance}" for one in followed]
    return f"{listed(each)} {'is' if len(each) == 1 else 'are'} between conditions"


def unexplained_nuisances(followed: Sequence[Followed]) -> list[str]:
    """A warning if nuisances follow the condition and no effect explains it."""
    if not followed:
        return []
    names = listed([one.nuisance for one in followed])
    return [
        f"{follow_in_words(followed)}, though it is declared to vary between runs. If the conditions do not set"
        f" {names}, the model lacks something that acts like it."
    ]


def warnings_of(fitted: Fit, split: Split) -> tuple[str, ...]:
    """Reasons to doubt a fit, the most serious first: what it fails to predict, parameters, nuisances."""
    known = {trial.name for trial in fitted.problem.trials}
    others = [trial for trial in split.not_fitted if trial.name not in known]
    held_out = evaluate_on(fitted, others) if others else None
    fits = [fitted, held_out] if held_out else [fitted]
    said = []
    if names := failed(with_residuals(fits)):
        said.append(
            f"The model could not predict {listed(names)}: counted as badly predicted when explanations are compared,"
            " and left out of the errors."
        )
    return (*said, *_edges(fitted), *_parameters(fitted), *_far_nuisances(fits))


def _edges(fitted: Fit) -> list[str]:
    """Warnings for parameters with failing simulations close by: a search takes no step to where the model fails, so it
    may have stopped there. Close is a standard deviation, or as far as derivatives step, since a derivative with a
    failing step makes the standard deviation tiny."""
    problem, point, structure = fitted.problem, fitted.solution.point, fitted.structure
    lower, upper = structure.bounds(point.values)
    ways: list[tuple[Estimate, int, np.ndarray]] = []
    for estimate, index in zip(uncertainty(fitted).estimates, fitted.solution.free, strict=True):
        scale = structure.parameters[index].step_scale
        far = np.clip(estimate.sd, LARGEST_STEP * scale, scale)
        for value in np.clip([estimate.value - far, estimate.value + far], lower[index], upper[index]):
            if not is_learnt(estimate.name) and value != estimate.value:
                ways.append((estimate, index, np.where(np.arange(len(lower)) == index, value, point.values)))

    def of_trial(i: int) -> np.ndarray:
        """Which of the ways make a trial fail that can be simulated here, shape (n,)."""
        moving = np.array([structure.moves(index, problem.trials[i]) for _, index, _ in ways], bool)
        places = [point.values, *(values for (*_, values), moves in zip(ways, moving, strict=True) if moves)]
        here, *there = problem.fails(i, [(values, point.nuisances[i]) for values in places])
        moving[moving] = np.array(there, bool) & ~here
        return moving

    found = []
    failing = np.array(in_parallel(of_trial, range(len(problem.trials)), problem.sizes)).T
    for (estimate, index, values), trials in zip(ways, failing, strict=True):
        if trials.any():
            name = problem.trials[int(np.argmax(trials))].name
            stopped, there = (structure.system.told(estimate.name, v) for v in (estimate.value, values[index]))
            found.append(
                f"{estimate.name} = {_quantity(stopped, estimate.unit)} may be where the search had to stop, not the"
                f" best value: close by, at {there:.4g}, simulations fail, such as that of {name}"
                f" ({_cause(problem, Point(values, point.nuisances), name)})."
            )
    return found


def _cause(problem: Problem, point: Point, name: str) -> str:
    """Why the simulation of a trial fails."""
    index, structure = [t.name for t in problem.trials].index(name), problem.structure
    trial, theta = problem.trials[index], structure.theta(point.values)
    values = {**theta, **problem.named(index, point.nuisances[index])}
    found = structure.system.attempt(values, structure.effects, trial, corrections=structure.corrections(theta))
    return found if isinstance(found, str) else misshapen(found, trial) or "the prediction is NaN"


def _parameters(fitted: Fit) -> list[str]:
    known = uncertainty(fitted)
    told = fitted.structure.system.told
    found = [
        f"{e.name} is at its bound ({_quantity(told(e.name, _bound(fitted, e)), e.unit)}): widen it unless it is a"
        " physical limit."
        for e in known.estimates
        if e.at_bound and e.determined
    ]
    found += [
        f"{e.name} = {_quantity(told(e.name, e.value), e.unit)} lies outside its plausible range."
        for e in known.estimates
        if e.implausible and not e.at_bound
    ]
    # where there are no data a learnt curve follows its prior, so any number of its directions are undetermined
    own = [[name for name in direction if not is_learnt(name)] for direction in known.undetermined]
    found += [
        f"The data hardly determine {'a combination of ' if len(names) > 1 else ''}{listed(names)}."
        for names in own
        if names
    ]
    return list(dict.fromkeys(found))


def _far_nuisances(fits: list[Fit]) -> list[str]:
    """Warnings for nuisances far from their expected value, singly or on average, or more scattered than declared."""
    runs: dict[str, list[NuisanceOfRun]] = {}
    for run in runs_of(fits):
        runs.setdefault(run.nuisance.name, []).append(run)
    found = []
    for name, each in runs.items():
        away, nuisance = np.array([one.away for one in each]), each[0].nuisance
        # robust against a few trials that are far from all others
        spread = max(min(float(np.std(away)), 1.4826 * float(np.median(np.abs(away - np.median(away))))), 1.0)
        if spread > _MAX_SPREAD:
            scale = spread * nuisance.step_scale
            found.append(
                f"{name} varies between trials with a standard deviation of about {_quantity(scale, nuisance.unit, 2)},"
                f" where {_quantity(nuisance.step_scale, nuisance.unit)} is declared: what exceeds that counts as noise"
                f" and may hide what is missing. Unless it is model error, declare it: scale={scale:.2g}."
            )
        elif far := [one.trial.name for one in each if abs(one.away) > _NEAR_LIMIT]:
            found.append(
                f"{name} is more than {_NEAR_LIMIT:g} standard deviations from its expected value in {listed(far)}: it"
                " probably absorbs model error."
            )
        if abs(away.sum()) > _NEAR_LIMIT * spread * len(each) ** 0.5:
            mean = sum(one.value for one in each) / len(each)
            expected = sum(one.nuisance.value for one in each) / len(each)
            found.append(
                f"{name} is {_quantity(mean, nuisance.unit)} on average over {len(each)} trials, where"
                f" {_quantity(expected, nuisance.unit)} is expected: declare that average, or other runs are predicted"
                " worse."
            )
    return found


def impossible_signs(fitted: Fit, policy: Policy) -> list[str]:
    """Warnings for effects that would help only beyond their bounds: those with one size, absent at a bound, that would
    to first order remove more than the policy's `share` of the residual of `fitted` with the opposite sign."""
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
    scores = score(fitted, able, Workers(lambda _: None)) if able else None
    smallest = {secant.effect: secant for secant in reversed(scores.secants)} if scores else {}
    for one in scores.screened() if scores else ():
        if one.wrong_sign > policy.share and not _fails(smallest[one.effect]):
            effect = system.effects[one.effect]
            size = effect.parameters[0]
            told, typical = (system.told(effect.full_name(size), value) for value in (effect.absent, size.value))
            side, bound = "below" if told < typical else "above", f"{told:g} {size.unit}".rstrip()
            found.append(f"{one.effect} would fit with a {size.name} {side} {bound}, which its bounds forbid.")
    return found


def _fails(begun: Promise) -> bool:
    """Whether the model cannot predict some trial where a fit with an effect begins, so that its score says nothing."""
    problem = begun.problem
    return bool(failed(zip(problem.trials, problem.scaled(problem.predict_all(begun.start)), strict=True)))


def _bound(fitted: Fit, at: Estimate) -> float:
    """The bound at which a parameter stopped; its value if the bound is another parameter."""
    parameter = fitted.structure.parameters[fitted.structure.names.index(at.name)]
    if parameter.at_least:
        return at.value
    return min((parameter.lower, parameter.upper), key=lambda bound: abs(at.value - bound))


def _quantity(value: float, unit: str, digits: int = 4) -> str:
    return f"{value:.{digits}g} {unit}".rstrip()
