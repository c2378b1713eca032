"""Learnt curves where the data say nothing."""

import numpy as np
from scipy.stats import gmean
from toy import hide

from lacuna.diagnosis.residual_error import rms
from lacuna.estimation.fit import evaluate_on, fit
from lacuna.estimation.noise import estimate_noise
from lacuna.estimation.shrink import shrunk
from lacuna.estimation.structure import Structure, is_learnt
from lacuna.estimation.uncertainty import uncertainty

RIPPLE = {"ripple.force_N": 0.08}  # no effect of the library


def with_curve(system):
    return fit(Structure(system, (), ("spring",)), system.trials, estimate_noise(system, system.trials))


def knots_of(fitted):
    return [estimate for estimate in uncertainty(fitted).estimates if is_learnt(estimate.name)]


def test_a_curve_is_zero_where_no_trial_went_give_or_take_its_size():
    before = with_curve(hide(RIPPLE, seed=4, sizes=(0.3, 0.5)))  # within 26 mm of 80
    after = shrunk(before)
    old, new = knots_of(before), knots_of(after)
    outer = [k for k, knot in enumerate(old) if not knot.determined]
    assert outer == [0, 1, 7, 8]
    size = np.sqrt(np.mean([knot.value**2 for knot in old if knot.determined]))
    for k in outer:
        assert abs(new[k].value) < size
        assert 0.9 * size < new[k].sd < 1.2 * size < 0.2 * old[k].sd
    for k in (3, 4, 5):
        assert abs(new[k].value - old[k].value) < old[k].sd
    assert rms(after.scaled_residuals()) < 1.01 * rms(before.scaled_residuals())


def test_larger_motions_than_were_seen_are_predicted_better():
    ratios = []
    for seed in range(50, 56):
        small, large = (hide(RIPPLE, seed=seed, sizes=sizes) for sizes in ((0.3, 0.5), (1.0, 2.0)))
        fits = [before := with_curve(small), shrunk(before)]
        old, new = (rms(evaluate_on(fitted, large.trials).scaled_residuals()) for fitted in fits)
        ratios.append(new / old)
    assert gmean(ratios) < 0.7, np.round(ratios, 2)


def test_without_a_curve_there_is_nothing_to_shrink():
    system = hide({}, seed=1, repeats=1)
    fitted = fit(Structure(system), system.trials, estimate_noise(system, system.trials))
    assert shrunk(fitted) is fitted
