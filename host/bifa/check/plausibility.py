"""Mistakes made in the lab that the format cannot detect: wrong signs, mirrored axes, exchanged tubes, a wrong gait or
unit.

A diagnosis would look for their cause in the robot. Each kind has its own file, which notes its limits and how far
healthy data stay from them even with strong effects. None of these checks changes what is fitted.
"""

from collections.abc import Iterable, Sequence

from bifa.data import Dataset, Trial

from .finding import Finding
from .known import check_known
from .repeats import check_copies, check_repeats
from .schedule import check_switches
from .signs import check_anchor_pull, check_static_loading, check_step_response
from .units import check_strokes, check_units
from .walks import check_walk

_CHECKS = {
    "static_loading": check_static_loading,
    "step_response": check_step_response,
    "anchor_pull": check_anchor_pull,
}


def check_trial_plausibility(trial: Trial, walks: Sequence[Trial] = ()) -> list[Finding]:
    """Return likely mistakes in one trial; `walks`: the day's other walks, whose gaits it may really be."""
    if trial.experiment == "locomotion":
        return [*check_walk(trial, walks), *check_switches(trial), *check_units(trial)]
    switches = check_switches(trial) if trial.experiment == "step_response" else ()
    return [*_CHECKS[trial.experiment](trial), *switches, *check_units(trial)]


def check_plausibility(dataset: Dataset) -> list[Finding]:
    """Return likely mistakes in a data set: in the declared values, in single trials, in repeats that differ."""
    walks = dataset.of("locomotion")
    found = [finding for trial in dataset.trials for finding in check_trial_plausibility(trial, walks)]
    found += check_strokes(dataset, _files(finding for finding in found if finding.kind == "unit"))
    files = _files(found)
    odd = list(check_repeats(dataset, files))
    copies = check_copies(dataset, _files(odd) | {file for finding in odd for file in finding.files})
    return [*check_known(dataset.known), *found, *copies, *odd]


def _files(findings: Iterable[Finding]) -> set[str]:
    return {finding.file for finding in findings if finding.file is not None}
