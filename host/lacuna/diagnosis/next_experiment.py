"""Which experiment would distinguish the explanations that this data cannot?"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lacuna.check.model import predict_unchecked
from lacuna.diagnosis.decide import Choice, dispersion_of
from lacuna.diagnosis.search import Search
from lacuna.estimation.noise import NoiseFloor
from lacuna.system import CandidateExperiment, Channels

_TELLS_APART = 5.0  # log-likelihood


@dataclass(frozen=True)
class NextExperiment:
    """The proposed experiment; None if there is nothing to separate or none on offer does. `separates`: the effects
    that it distinguishes; `gain`: expected log-likelihood ratio between the two closest explanations."""

    separates: tuple[str, ...] = ()
    experiment: str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    gain: float = 0.0


def next_experiment(choice: Choice, found: Search) -> NextExperiment:
    """The experiment on offer that best separates the choice from its rivals, in which an effect is exchanged for one
    that it may be confused with: the one with the largest expected gain between the two closest predictions."""
    chosen = frozenset(choice.candidate.effects)
    exchanges = [(effect, other) for effect, others in choice.confusable_with.items() for other in others]
    others = [found.with_effects(chosen - {effect} | {other}) for effect, other in exchanges]
    rivals = [choice.candidate, *(other for other in others if other is not None)]
    if len(rivals) < 2:
        return NextExperiment()
    system, dispersion = rivals[0].fitted.structure.system, dispersion_of(found.tried)
    best = NextExperiment()
    for offer in system.candidate_experiments():
        predictions = [predict_unchecked(system, c.fitted.theta, c.effects, offer.trial) for c in rivals]
        gains = [
            expected_gain(a, b, offer, found.floor) / dispersion
            for k, a in enumerate(predictions)
            for b in predictions[:k]
        ]
        if min(gains) > best.gain:
            every = {name for c in rivals for name in c.effects}
            names = sorted(name for name in every if not all(name in c.effects for c in rivals))
            best = NextExperiment(tuple(names), offer.experiment, dict(offer.settings), float(min(gains)))
    return best if best.gain > _TELLS_APART else NextExperiment()


def expected_gain(a: Channels, b: Channels, offer: CandidateExperiment, floor: NoiseFloor) -> float:
    """Expected log-likelihood ratio of two predictions: half the sum of squared differences in standard deviations
    (each at most 10), with samples thinned to independent pieces."""
    total, known = 0.0, {channel for _, channel in floor.channels}
    for channel in (c for c in a if c in known):
        noise = floor.of(offer.experiment, channel)
        z = np.abs(a[channel] - b[channel]) / noise.sd_at(a[channel])
        total += 0.5 * float(np.nansum(np.minimum(z, 10.0) ** 2)) / noise.samples_per_piece
    return total
