"""A known explanation fitted to more data, and data that call for a diagnosis instead."""

import numpy as np
import pytest
from toy import draw_base, hide

from lacuna.diagnosis.refit import refit
from lacuna.estimation.uncertainty import intervals

SIZE = {"coulomb.force_N": 0.1}
OTHER = {"delay.delay_s": 0.01}
MISSING = {"another": (SIZE | OTHER, ("coulomb",)), "wrong": (OTHER, ("coulomb",)), "none": (OTHER, ())}


def test_the_known_effect_is_refitted_to_its_size():
    held = []
    for seed in range(60, 66):
        guess = {name: 1.1 * value for name, value in (draw_base(np.random.default_rng(seed)) | SIZE).items()}
        found = refit(hide(SIZE, seed=seed), ("coulomb",), guess)
        truth, within = draw_base(np.random.default_rng(seed)) | SIZE, intervals(found)
        assert found.structure.effects == ("coulomb",)
        assert found.theta["coulomb.force_N"] == pytest.approx(0.1, rel=0.1)
        held += [within[name][0] <= true <= within[name][1] for name, true in truth.items()]
    assert np.mean(held) >= 0.8, "24 intervals of 90 %"


def test_a_base_model_that_suffices_is_refitted():
    assert refit(hide({}, seed=61), (), {}).structure.effects == ()


def test_two_trials_call_for_a_diagnosis_which_says_why_it_fails():
    assert refit(hide(SIZE, seed=63, repeats=1, sizes=(1.0,)), ("coulomb",), SIZE) is None


@pytest.mark.parametrize(("hidden", "known"), MISSING.values(), ids=MISSING)
def test_what_lacks_an_effect_calls_for_a_diagnosis(hidden, known):
    assert refit(hide(hidden, seed=62), known, SIZE if known else {}) is None
