"""Fixed and tied parameters: what the model is given, what is reported, and what is refused."""

from dataclasses import replace

import heater
import numpy as np
import pytest

import lacuna
from lacuna import Effect, Parameter
from lacuna.errors import DeclarationError, MisuseError
from lacuna.estimation.fit import fit
from lacuna.estimation.noise import estimate_noise
from lacuna.estimation.structure import Structure
from lacuna.system import Record
from lacuna.verdict import CompletedModel

SPREAD = Effect(
    "spread", (Parameter("size", "", 0.2, -1.0, 1.0), Parameter("at_W", "W", 5.0, 1.0, 20.0)), equation="size, at"
)
SPARE = Parameter("tau_other_s", "s", 3.0, 0.1, 100.0)


def seen(**held):
    """The values that `simulate` receives when all fitted parameters are 2, and the system."""
    system = lacuna.System(heater.simulate, (*heater.PARAMETERS, SPARE), [SPREAD], outputs="temperature_K", **held)
    fitted = {p.name: system.coordinate(p.name).fitted(2.0) for p in system.parameters}
    return system.values(fitted | {"spread.size": 0.5}), system


def test_a_fixed_parameter_has_its_value_and_is_not_fitted():
    given, system = seen(fixed={"tau_s": 15.0, "spread.at_W": 7.0})
    assert [p.name for p in system.parameters] == ["gain_K_W", "tau_other_s"]
    assert [p.name for p in system.effects["spread"].parameters] == ["size"]
    assert given["tau_s"] == 15.0
    assert given["spread.at_W"] == 7.0
    assert list(given)[:3] == ["gain_K_W", "tau_s", "tau_other_s"]  # in the order of their declaration


def test_a_tied_parameter_follows_another_whether_that_is_fitted_or_fixed():
    given, system = seen(tied={"tau_other_s": "tau_s"})
    assert [p.name for p in system.parameters] == ["gain_K_W", "tau_s"]
    assert given["tau_other_s"] == given["tau_s"] == pytest.approx(2.0)
    given, _ = seen(tied={"tau_other_s": "tau_s"}, fixed={"tau_s": 9.0})
    assert given["tau_other_s"] == 9.0


def test_a_diagnosis_names_the_same_and_tells_of_what_it_held():
    lag = {"sensor_lag__lag_s": 3.0}
    found = lacuna.diagnose(heater.system(fixed={"tau_s": 15.0}), heater.records(seed=1, **lag), progress=False)
    assert [e.name for e in found.effects] == ["sensor_lag"]
    assert found.theta["tau_s"] == 15.0
    assert np.isnan(found.to_frame().loc["tau_s", "lower_90"])
    assert found.effects[0].parameters["lag_s"] == pytest.approx(3.0, rel=0.05)


@pytest.mark.parametrize(
    ("held", "says"),
    [
        ({"fixed": {"mass": 1.0}}, "there is no mass; there are gain_K_W, tau_s"),
        ({"fixed": {"tau_s": "15"}}, "tau_s is fixed at '15'"),
        ({"fixed": {"tau_s": float("inf")}}, "tau_s is fixed at inf"),
        ({"fixed": {"tau_s": 0.0}}, "tau_s is fixed at 0, outside its bounds"),
        ({"fixed": {"spread.at_W": -1e9}}, "spread.at_W is fixed at -1e"),
        ({"fixed": ["tau_s"]}, "fixed is"),
        ({"tied": "tau_s"}, "tied is 'tau_s'"),
        ({"fixed": {"spread.size": 0.0}}, "spread.size sets the size of an effect"),
        ({"tied": {"tau_s": "mass"}}, "tau_s is tied to 'mass', which is not one of gain_K_W"),
        ({"tied": {"tau_s": "tau_s"}}, "tau_s is tied to 'tau_s'"),
        ({"tied": {"tau_s": "gain_K_W"}, "fixed": {"tau_s": 1.0}}, "both fixed and tied"),
        ({"tied": {"spread.at_W": "tau_s"}}, r"at_W would follow tau_s \(.* beyond its own bounds, 1 to 20"),
        ({"tied": {"spread.at_W": "tau_s"}, "fixed": {"tau_s": 25.0}}, r"tau_s \(fixed at 25\) beyond"),
        ({"fixed": {"tau_s": 15.0, "gain_K_W": 1.0, "tau_other_s": 1.0}}, "leave one to be fitted"),
    ],
)
def test_what_may_not_be_held_is_refused(held, says):
    with pytest.raises(DeclarationError, match=says):
        seen(**held)


def test_a_completed_model_ties_again_what_is_tied_and_takes_nothing_that_is_held():
    def simulate(record, theta):
        return {"y": theta.left * np.sin(record.time_s) + theta.right * np.cos(record.time_s) + theta.known}

    parameters = [Parameter(name, "", 1.0, 0.1, 5.0) for name in ("left", "right", "known")]
    time_s = np.linspace(0.0, 10.0, 101)
    trials = tuple(Record(f"{k}", "run", "c", time_s, {"y": np.sin(time_s) + 0.1 * k}) for k in range(3))
    system = lacuna.System(simulate, parameters, tied={"right": "left"}, fixed={"known": 1.0}).with_trials(trials)
    model = CompletedModel(system, fit(Structure(system), trials, estimate_noise(system, trials)))
    assert model(trials[0], {"left": 3.0})["y"][0] == 4.0
    np.testing.assert_array_equal(model(trials[0], model.theta)["y"], model(trials[0])["y"])
    assert model(trials[0], model.theta | {"left": 3.0})["y"][0] == 4.0
    for name in ("right", "known"):
        with pytest.raises(MisuseError, match=f"{name} is fixed or tied"):
            model(trials[0], {name: 3.0})
    with pytest.raises(MisuseError, match="called with one record, not 3"):
        model(trials)


def test_a_nuisance_of_the_name_of_a_fixed_parameter_is_refused():
    rest = Parameter("rest_K", "K", 0.0, -1.0, 1.0)
    parameters, nuisance = (*heater.PARAMETERS, rest), replace(rest, scale=0.1)
    system = lacuna.System(heater.simulate, parameters, fixed={"rest_K": 0.0}, nuisances=nuisance)
    with pytest.raises(DeclarationError, match="steps_4W_1: its nuisance rest_K has the name of another"):
        lacuna.diagnose(system, heater.records(2), progress=pytest.fail)
