"""Learnt curves outside the range of the data."""

from dataclasses import replace

import numpy as np
import pytest
from toy import case_of, hide

import lacuna
from lacuna import CorrectionSite, Parameter, Record
from lacuna.diagnosis import warn
from lacuna.estimation.fit import fit
from lacuna.estimation.noise import estimate_noise
from lacuna.estimation.shrink import likeliest_size, shrunk
from lacuna.estimation.structure import Structure, is_learnt
from lacuna.estimation.uncertainty import uncertainty

TIME_S = np.linspace(0.0, 10.0, 201)
KNOTS = np.linspace(0.0, 1.0, 33)


def truth(x):
    return 0.3 * np.sin(30.0 * x)


def with_curve(seed, upper, offset=True):
    """A fit of a sine, an offset and a curve over x from 0 to 1, of which the records cover 0 to `upper`."""
    draw = np.random.default_rng(seed)
    x = upper * np.abs(np.sin(0.7 * TIME_S))
    y = np.sin(3.0 * TIME_S) + (1.0 if offset else 0.0) + truth(x)
    trials = [
        Record(str(i), "run", "run", TIME_S, {"y": y + 0.02 * draw.standard_normal(201)}, inputs={"x": x})
        for i in range(4)
    ]
    parameters = [Parameter("gain", "", 1.0, 0.1, 5.0), *([Parameter("level", "", 1.0, -5.0, 5.0)] if offset else [])]
    system = lacuna.System(
        lambda record, theta: {
            "y": theta.gain * np.sin(3.0 * record.time_s) + (theta.level if offset else 0.0) + theta.curve(record["x"])
        },
        parameters,
        curves=[CorrectionSite("curve", "the level", "x", "", 0.0, 1.0, 0.5, knots=len(KNOTS))],
    ).with_trials(trials)
    structure = Structure(system, (), ("curve",))
    return fit(structure, system.trials, estimate_noise(system, system.trials))


def knots_of(fitted):
    found = [estimate for estimate in uncertainty(fitted).estimates if is_learnt(estimate.name)]
    return np.array([one.value for one in found]), np.array([one.sd for one in found])


@pytest.mark.parametrize("offset", [True, False])  # an offset is confounded with the curve's mean
@pytest.mark.parametrize("seed", [1, 2])
def test_a_curve_is_zero_where_no_trial_went_give_or_take_its_size(seed, offset):
    before = with_curve(seed, upper=0.5, offset=offset)
    after = shrunk(before)
    (_, old_sd), (new, new_sd) = knots_of(before), knots_of(after)
    seen, beyond = KNOTS < 0.47, KNOTS > 0.57
    size = np.std(truth(KNOTS[seen]))
    assert np.abs(new[beyond]).max() < 0.1 * size
    assert new_sd[beyond] == pytest.approx(size, rel=0.3)
    assert new_sd[beyond].max() < 0.5 * old_sd[beyond].min()
    mean = np.mean(new[seen] - truth(KNOTS[seen]))
    assert new[seen] - mean == pytest.approx(truth(KNOTS[seen]), abs=0.05)


def test_a_curve_that_is_seen_whole_stays_as_it_is():
    before = with_curve(3, upper=1.0, offset=False)
    (old, sd), (new, _) = knots_of(before), knots_of(shrunk(before))
    assert (np.abs(new - old) < 0.5 * sd).all()


def test_a_curve_that_is_but_noise_is_none():
    size, told = likeliest_size(np.random.default_rng(0).standard_normal(33), 4.0 * np.eye(33), least=0.01)
    assert size == pytest.approx(0.01)
    assert not told.any()


def test_without_a_curve_there_is_nothing_to_shrink():
    fitted = with_curve(5, upper=0.5)
    bare = fit(Structure(fitted.structure.system), fitted.problem.trials, fitted.problem.floor)
    assert shrunk(bare) is bare


def test_no_knot_of_a_learnt_curve_is_said_to_be_undetermined(monkeypatch):
    """Beyond the data a curve follows its prior; a direction spread over many parameters is not named at all."""
    case = case_of(hide({}, seed=31))
    name = case.system.parameters[0].name
    undetermined = ({"correction.spring.0_1": 0.9}, {"correction.spring.0_2": 0.6, name: 0.8}, {})
    monkeypatch.setattr(warn, "uncertainty", lambda fit: replace(uncertainty(fit), undetermined=undetermined))
    said = warn.warnings_of(case.fit_base(1), case.split)
    assert said == (f"The data hardly determine {name}.",)
