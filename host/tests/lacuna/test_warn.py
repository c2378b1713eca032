"""What a verdict warns of when curves were learnt."""

import numpy as np
from toy import hide

from lacuna.diagnosis import warn
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.split import split_trials
from lacuna.estimation.uncertainty import Uncertainty


def test_no_knot_of_a_learnt_curve_is_said_to_be_undetermined(monkeypatch):
    """Beyond its data a curve is what its prior makes of it; a direction that is spread thin has no name at all."""
    system = hide({}, seed=31)
    split = split_trials(system.trials)
    name = system.parameters[0].name
    undetermined = ({"correction.spring.0_1": 0.9}, {"correction.spring.0_2": 0.6, name: 0.8}, {})
    monkeypatch.setattr(warn, "uncertainty", lambda _: Uncertainty((), np.eye(0), undetermined))
    said = warn.warnings_of(Case(system, split, POLICY, 0).fit_base(1), split)
    assert said == (f"The data hardly determine {name}.",)
