"""Effects absorbed by the factors of each run: an effect that depends on the condition is not scatter between runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from toy import NOBODY, case_of, moved

from lacuna.diagnosis.diagnose import diagnose
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.race import COARSE, add_each_effect
from lacuna.diagnosis.residual_error import excess_over
from lacuna.diagnosis.sizes import starts
from lacuna.estimation.fit import fit, predictive
from lacuna.estimation.solve import solve
from lacuna.estimation.structure import Structure
from lacuna.system import CorrectionSite, Effect, Parameter, Record, System

SCATTER = 0.01  # of the friction, from run to run
SD = 0.02  # N
REPEATS = 4
SPEEDS_MM_S = (2.0, 5.0, 8.0, 12.0, 20.0)
HOLDING_N, SLIDING_N = 1.07, 1.0


def friction(holding_N, sliding_N, speed_mm_s, fading_mm_s):
    return sliding_N + (holding_N - sliding_N) * np.exp(-((speed_mm_s / max(fading_mm_s, 1e-9)) ** 2))


@dataclass(frozen=True)
class Pulls(System):
    """A block pulled at several speeds. It holds for two samples; then its friction is kinetic, or, with the effect,
    falls with speed."""

    trials: tuple[Record, ...]
    name: str = "a block"
    parameters: tuple[Parameter, ...] = (
        Parameter("holding_N", "N", 1.15, 0.1, 5.0, scale=0.1, at_least="sliding_N"),
        Parameter("sliding_N", "N", 1.0, 0.1, 5.0, scale=0.1),
    )
    effects: ClassVar[Mapping[str, Effect]] = {
        "fading": Effect("fading", Parameter("speed_mm_s", "mm/s", 10.0, 0.0, 200.0), apart=("holding_N",)),
        "lag": Effect("lag", Parameter("time_s", "s", 0.1, 0.0, 1.0)),
    }

    def nuisances(self, trial):
        return (Parameter("factor", "", 1.0, 0.8, 1.25, scale=SCATTER, factor_of=("holding_N", "sliding_N")),)

    def predict(self, theta, effects, trial, *, coarse=False, corrections=()):
        slides = friction(theta["holding_N"], theta["sliding_N"], trial.payload, theta.get("fading.speed_mm_s", 0.0))
        force = np.where(trial.time_s < 0.02, theta["holding_N"], slides) * theta["factor"]
        risen = 1.0 - np.exp(-(trial.time_s + 1e-3) / max(theta.get("lag.time_s", 0.0), 1e-9))
        return {"force_N": force * risen}

    def sensor_noise(self, experiment, channel):
        return SD

    @property
    def correction_sites(self):
        site = CorrectionSite("friction", "friction", "speed (mm/s)", "N", 0.0, 20.0, 0.05, experiments=())
        return {site.name: site}


def measured(fading_mm_s: float, seed: int) -> Pulls:
    draw, time_s = np.random.default_rng(seed), np.arange(100) / 100
    trials = []
    for repeat in range(REPEATS):
        for speed in SPEEDS_MM_S:
            force = np.where(time_s < 0.02, HOLDING_N, friction(HOLDING_N, SLIDING_N, speed, fading_mm_s))
            force = force * (1 + SCATTER * draw.standard_normal()) + SD * draw.standard_normal(len(time_s))
            trials.append(Record(f"{speed}_{repeat}", "pull", speed, time_s, {"force_N": force}, len(trials), speed))
    return Pulls(tuple(trials))


def diagnosed(fading_mm_s: float, seed: int):
    """The case of a data set, and its base fit."""
    case = case_of(measured(fading_mm_s, seed))
    return case, case.judge(case.fit_base(1))


def test_what_is_foreseen_of_a_run_is_the_mean_of_its_factors():
    fitted = diagnosed(10.0, 1)[1].fitted
    assert any(abs(values[0] - 1.0) > SCATTER for values in fitted.solution.point.nuisances)
    before = predictive(fitted)
    assert all(values[0] == 1.0 for values in before.solution.point.nuisances)
    assert before.cost > fitted.cost
    assert before.theta == fitted.theta


@pytest.mark.parametrize(("fading_mm_s", "seed", "found"), [(10.0, 2, "fading"), (0.0, 3, None), (0.0, 4, None)])
def test_an_effect_that_the_factors_of_each_run_take_up_is_found(fading_mm_s, seed, found):
    case, base = diagnosed(fading_mm_s, seed)
    assert not case.remainder(case.converged(base)).matters, "nothing of it is left in the residual"
    assert case.hidden(base) == found
    assert case.suffices(base) is (found is None)


def test_nothing_is_grown_on_an_explanation_with_a_learnt_curve():
    case, base = diagnosed(10.0, 7)
    curved = Structure(case.system, (), ("friction",))
    assert case.hidden(case.judge(fit(curved, case.split.fit, base.fitted.problem.floor))) is None


def test_an_effect_with_nothing_to_do_is_refitted_from_all_of_its_sizes():
    """From equal frictions, steps along derivatives would make them equal again, whatever the start size."""
    case, base = diagnosed(10.0, 8)
    one = moved(base.fitted, holding_N=base.fitted.theta["sliding_N"])
    structure = Structure(case.system, ("fading",))
    begun = starts(one, structure, "fading")
    assert len(begun) == 3
    assert all(theta["holding_N"] > theta["sliding_N"] for theta in map(structure.theta, begun))
    (refitted,) = add_each_effect(one, ["fading"], NOBODY)
    problem = refitted.problem
    alone = [solve(problem, problem.start(v, one.solution.point.nuisances), **COARSE).cost for v in begun]
    assert refitted.cost == min(alone)
    assert max(alone) > min(alone) + POLICY.gain, "only some of the start sizes lead to the optimum"


@pytest.mark.parametrize(("fading_mm_s", "seed", "verdict"), [(10.0, 5, "identified"), (0.0, 6, "none")])
def test_it_is_named_though_there_is_no_gap_to_close(fading_mm_s, seed, verdict):
    found = diagnose(measured(fading_mm_s, seed))
    assert found.verdict == verdict
    assert [e.name for e in found.effects] == (["fading"] if fading_mm_s else [])
    if fading_mm_s:
        assert excess_over([found.base], [found.explained], found.search.base.fitted.structure.system.accuracy) < 0.21
        assert found.effects[0].parameters["speed_mm_s"] == pytest.approx(fading_mm_s, rel=0.25)
