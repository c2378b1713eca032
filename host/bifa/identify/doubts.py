"""Reasons to doubt what is fitted to a data set: curves that were not measured, and repeats that are none."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bifa.problem.inputs import WALK
from bifa.problem.system import CURVE_OF, RobotSystem
from lacuna.check.numbers import fast_noise
from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.estimation.fit import Fit
from lacuna.estimation.noise import least_sd

_MAX_REPEAT_RATIO = 5.0  # differences between repeats, over the fast noise; healthy: below 3, if noise is colored


def with_doubts(found: Diagnosis, system: RobotSystem) -> Diagnosis:
    """Return the diagnosis with these reasons before its warnings."""
    return replace(found, warnings=(*assumed_curves(system), *repeats_apart(found.base), *found.warnings))


def assumed_curves(system: RobotSystem) -> tuple[str, ...]:
    """A sentence for each actuator whose stiffness curve the trials need but do not determine."""
    felt = set()
    for trial in system.dataset.trials:
        felt |= set(CURVE_OF) if trial.experiment == WALK else {trial.actuator or "small"}  # a pull tests a head
    return tuple(
        f"There is no static_loading of the {actuator} actuator at 0 psi, so its stiffness curve is that of the model "
        f"{system.model.name!r}: where this robot's curve differs, the difference may be taken for an effect, or for "
        "something that no effect explains."
        for actuator, prefix in CURVE_OF.items()
        if prefix not in system.curves and actuator in felt
    )


def repeats_apart(fit: Fit) -> Iterator[str]:
    """Sentences on channels whose repeats differ by far more than their fast noise: an odd repeat, or an instrument
    that changed, raises the noise floor, so that the errors look small."""
    for (experiment, channel), noise in fit.problem.floor.channels.items():
        trials = [t for t in fit.problem.trials if t.experiment == experiment and channel in t.channels]
        if not noise.repeats or not trials:
            continue
        fast = float(np.median([fast_noise(t.time_s, t.channels[channel]) for t in trials]))
        least = max(fit.structure.system.sensor_noise(experiment, channel), least_sd(trials, channel))
        ratio = noise.sd / max(fast, least)  # rounded readings may lie on a line
        if ratio > _MAX_REPEAT_RATIO:
            yield (
                f"Repeats of {experiment} differ by {noise.sd:.2g} {channel.rpartition('_')[2]} in {channel}, "
                f"{ratio:.0f} times as much as neighboring samples do, and all of that counts as noise: was one "
                "recorded differently, or did an instrument change? `bifa check --pictures` plots them."
            )
