"""What a verdict warns of: curves that were learnt, nuisances away from what is expected."""

import heater
import numpy as np
import pytest
from toy import case_of, hide

import lacuna
from lacuna import Parameter
from lacuna.diagnosis import warn
from lacuna.estimation.uncertainty import Uncertainty


def test_no_knot_of_a_learnt_curve_is_said_to_be_undetermined(monkeypatch):
    """Beyond its data a curve is what its prior makes of it; a direction that is spread thin has no name at all."""
    case = case_of(hide({}, seed=31))
    name = case.system.parameters[0].name
    undetermined = ({"correction.spring.0_1": 0.9}, {"correction.spring.0_2": 0.6, name: 0.8}, {})
    monkeypatch.setattr(warn, "uncertainty", lambda _: Uncertainty((), np.eye(0), undetermined))
    said = warn.warnings_of(case.fit_base(1), case.split)
    assert said == (f"The data hardly determine {name}.",)


@pytest.mark.parametrize(("mean_C", "said"), [(20.0, 0), (24.5, 1)])
def test_nuisances_that_are_all_a_little_off_are_pointed_out(mean_C, said):
    """None is far from what is expected by itself; together they are seven standard errors off."""
    draw = np.random.default_rng(0)

    def cooling(record, theta):
        return {"temperature_C": theta.room_C + 60.0 * np.exp(-record.time_s / theta.tau_s)}

    room = Parameter("room_C", "C", 20.0, 0.0, 40.0, scale=2.0)
    system = lacuna.System(cooling, [Parameter("tau_s", "s", 30.0, 5.0, 200.0)], nuisances=[room])
    records = []
    for _ in range(10):
        clean = mean_C + draw.standard_normal() + 60.0 * np.exp(-heater.TIME_S / 40.0)
        noise = 0.1 * draw.standard_normal(len(clean))
        records.append({"time_s": heater.TIME_S, "temperature_C": clean + noise, "condition": len(records)})
    found = [one for one in lacuna.diagnose(system, records, progress=False).warnings if one.startswith("room_C")]
    assert len(found) == said
    assert all("on average over 10 trials, where 20 C is expected" in one for one in found)
