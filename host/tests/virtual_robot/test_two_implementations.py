"""The host's simulator and the virtual robot's plant share no code and agree on every effect of the contract.

The simulator is linearly implicit with a polynomial spring, the plant explicit with event location and a spline;
only the equations are common to both. Given the true parameters, the simulator must predict the plant's noiseless
records to a fraction of the sensors' noise.
"""

from dataclasses import replace

import numpy as np
import pytest

from bifa import robot, simulate
from bifa.ranges import CHAMBERS
from bifa.robot.gait import Gait
from bifa.robot.stiffness import StiffnessCurve
from bifa.simulate.stepper import OFF, POSITIVE, VACUUM
from virtual_robot.effects import EFFECTS, LIBRARY, plant_parameters
from virtual_robot.gait import BASELINE, EASY
from virtual_robot.instruments.sensors import Noise
from virtual_robot.plant import NOMINAL, Curve, Plant, nominal_curves
from virtual_robot.trials import Lab, Plan

pytestmark = pytest.mark.slow

COMMANDS = {"positive": POSITIVE, "vacuum": VACUUM, "off": OFF}
NOISE = {"force_N": 0.15, "displacement": 0.1, "pressure": 0.06}
PLANS = (
    Plan("static_loading", "static", "body", 4.0, 0.008),
    Plan("step_response", "step", "body", 8.5),
    Plan("step_response", "step", "head", 8.5),
    Plan("anchor_pull", "anchor", "head", 8.5, 0.020),
    Plan("locomotion", "baseline", gait=BASELINE, cycles=2),
    Plan("locomotion", "easy", gait=EASY, cycles=2),
)


class Nothing:
    """A random generator that draws only zeros: no wobble, phases of 0."""

    def standard_normal(self, shape=()):
        return np.zeros(shape)

    def uniform(self, *_):
        return 0.0


def polynomial(curve: Curve) -> StiffnessCurve:
    z = np.linspace(-1.0, 1.0, len(curve.force_N))
    fitted = np.polynomial.Polynomial.fit(z, curve.force_N, 15, domain=[-1, 1], window=[-1, 1])
    return StiffnessCurve(tuple(fitted.coef), curve.displacement_m[0], curve.displacement_m[-1])


@pytest.fixture(scope="module")
def model():
    body, small = map(polynomial, nominal_curves())
    nominal = replace(robot.nominal(), body_stiffness=body, small_stiffness=small)
    return nominal.with_values({name: value for name, value in NOMINAL.items() if name in nominal.parameters})


def predicted(model, plan: Plan, seen: dict) -> simulate.SimulatedTrial:
    time_s = seen["time_s"]
    match plan.experiment:
        case "static_loading":
            return simulate.static_loading(model, plan.actuator, time_s, seen["displacement_mm"], plan.pressure_psi)
        case "step_response":
            command = seen["command"].astype(float)
            return simulate.step_response(model, plan.actuator, time_s, command, plan.pressure_psi)
        case "anchor_pull":
            return simulate.anchor_pull(model, time_s, plan.rate_m_s * 1e3, plan.pressure_psi)
        case _:
            return simulate.walk(model, Gait(**plan.gait.as_dict()), time_s=time_s, tolerance_m=1e-7)


@pytest.mark.parametrize("effect", ["none", *LIBRARY])
def test_agreement_to_a_fraction_of_the_noise(model, effect, monkeypatch):
    monkeypatch.setattr("virtual_robot.trials.converted_psi", lambda psi, *_: psi)
    effects = {} if effect == "none" else {effect: EFFECTS[effect].defaults()}
    lab = Lab(NOMINAL | plant_parameters(effects), noise=Noise(0, 0, 0, 0))
    right = model.with_effects(effects)
    for plan in PLANS:
        seen = lab.run(plan, 0.0, Nothing())
        record = predicted(right, plan, seen)
        for channel, values in seen.items():
            kind = channel if channel in NOISE else channel.split("_")[0]
            if kind in NOISE:
                error = np.sqrt(np.mean((values - record[channel]) ** 2)) / NOISE[kind]
                assert error < 0.5, (plan.name, channel)


@pytest.mark.parametrize("difference_s", [0.034, -0.034])
def test_late_valves_agree_where_chambers_are_vented_between_supplies(model, difference_s):
    """Chambers are vented before switching, as by the Uno; a late opening valve does not delay the closing one."""
    dead_time_s, effects = 0.004, {"valve_asymmetry": {"difference_s": difference_s}}
    time_s = np.arange(round(2 * EASY.period_s * 100)) / 100
    switches = EASY.switches(2 * EASY.period_s)
    plant, supplied = Plant(NOMINAL | plant_parameters(effects)), set()
    plant.mount("locomotion")
    for at, chamber, state in switches:
        if chamber in supplied:
            plant.connect(at, chamber, "off")
            at += dead_time_s
        plant.connect(at, chamber, state)
        supplied.add(chamber)
    seen = plant.record(time_s)
    plant.close()
    commanded = simulate.timeline([(at, CHAMBERS.index(c), COMMANDS[state]) for at, c, state in switches])
    commands = simulate.vented_between(commanded, dead_time_s)
    record = simulate.walk(model.with_effects(effects), time_s=time_s, commands=commands, tolerance_m=1e-7)
    for place, chamber in enumerate(CHAMBERS):
        error = seen["pressure_psi"][:, place] - record[f"pressure_{chamber}_psi"]
        assert np.sqrt(np.mean(error**2)) < 0.5 * NOISE["pressure"], chamber


@pytest.mark.parametrize("effect", ["backlash", "hysteresis"])
def test_a_spring_that_remembers_agrees_on_how_the_head_was_extended(model, effect):
    """The head is snapped out by pressure, vented, and pulled, as in bifa's own experiment; this history matters."""
    effects, time_s = {effect: EFFECTS[effect].defaults()}, np.arange(100) / 50
    plant = Plant(NOMINAL | plant_parameters(effects))
    plant.mount("anchor_pull", "head", "positive")
    plant.connect(10.0, "head", "off")
    plant.record([30.0])
    plant.move(30.0, 0.04, 0.02, there_and_back=False)
    seen = plant.record(30.0 + time_s)["force_N"]
    plant.close()
    right = model.with_effects(effects)
    extended = simulate.anchor_pull(right, time_s, 20.0, 0.0, extended_psi=NOMINAL["supply_positive_psi"])["force_N"]
    directly = simulate.anchor_pull(right, time_s, 20.0, 0.0)["force_N"]
    assert np.sqrt(np.mean((seen - extended) ** 2)) < 0.5 * NOISE["force_N"]
    assert np.sqrt(np.mean((seen - directly) ** 2)) > NOISE["force_N"]


def test_the_wrong_effect_does_not_agree(model):
    """The comparison above can fail: without the effect, the simulator misses the record by far."""
    lab = Lab(NOMINAL | plant_parameters({"hysteresis": {}}), noise=Noise(0, 0, 0, 0))
    seen = lab.run(PLANS[0], 0.0, Nothing())
    miss = seen["force_N"] - predicted(model, PLANS[0], seen)["force_N"]
    assert np.sqrt(np.mean(miss**2)) / NOISE["force_N"] > 10
