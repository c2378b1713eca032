"""How long what a diagnosis leaves remembers itself: the noise's correlation time where no repeats show it."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from lacuna.diagnosis.diagnose import Diagnosis
from lacuna.estimation.autocorrelation import correlation_samples
from lacuna.estimation.fit import evaluate_on
from lacuna.estimation.sampling import evenly, sample_period

_LONG = 3.0  # samples: what remembers itself for less is white for all that matters


def left_over_s(diagnosis: Diagnosis) -> dict[str, float]:
    """By channel without repeats the correlation time of the residual, in seconds, 0 where it is white."""
    final = diagnosis.final
    found: dict[str, float] = {}
    trials = diagnosis.base.structure.system.trials
    residuals = evaluate_on(final, trials).residuals()
    traces: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    periods: dict[tuple[str, str], list[float]] = defaultdict(list)
    for trial in trials:
        for channel, residual in residuals[trial.name].items():
            key, known = (trial.experiment, channel), residual[np.isfinite(residual)]
            if not known.size:
                continue
            traces[key].append(evenly(trial.time_s, residual / max(float(np.std(known)), 1e-300)))
            periods[key].append(sample_period(trial.time_s))
    for (experiment, channel), members in traces.items():
        if diagnosis.search.floor.of(experiment, channel).repeats:
            continue
        samples = correlation_samples(members)  # of exponential memory: twice the correlation time
        period = float(np.median(periods[experiment, channel]))
        found[channel] = max(found.get(channel, 0.0), 0.5 * samples * period if samples > _LONG else 0.0)
    return found
