"""Single actuators, compared with SciPy's LSODA, closed forms, and the paper's forces."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bifa import robot, simulate
from bifa.simulate import SimulationError

ON_S, OFF_S, STEP_PSI = 0.5, 4.0, 7.0


def _lsoda_step(model, actuator, time, slope, force_kept):
    """Eq. (1)-(3) as in the paper if `force_kept`, otherwise with a pressure in place of the force in eq. (2); smooth
    except at x_th. `slope`: relative change of the area over the stroke."""
    name, moved = {"large": ("body", "head"), "small": ("small", "small")}[actuator]
    curve, mass = getattr(model, f"{name}_stiffness"), model[f"{moved}_mass_kg"]
    b, nominal = model[f"{name}_damping_Ns_m"], model[f"{name}_area_N_psi"]
    fast, slow = model[f"{name}_alpha_n_per_s"], model[f"{name}_alpha_s_per_s"]
    vacuum = model["supply_negative_psi"]

    def area(x):
        return nominal * (1.0 + slope * (x - curve.contracted_m) / curve.stroke_m)

    start = np.array([-0.005, 0.0, vacuum * (area(-0.005) if force_kept else 1.0)])

    def rates(source):
        def right_hand_side(_, y):
            alpha = slow if y[0] > curve.unstable_m and source < 0.0 else fast
            push, aim = (y[2], source * area(y[0])) if force_kept else (y[2] * area(y[0]), source)
            return [y[1], (-float(curve.force(y[0])) - b * y[1] + push) / mass, alpha * (aim - y[2])]

        return right_hand_side

    options = {"method": "LSODA", "rtol": 1e-10, "atol": 1e-12, "max_step": 0.01}
    state = solve_ivp(rates(vacuum), (-10.0, 0.0), start, **options).y[:, -1]
    rows = []
    for first, last, source in ((0.0, ON_S, vacuum), (ON_S, OFF_S, STEP_PSI), (OFF_S, time[-1] + 0.01, vacuum)):
        inside = time[(time >= first) & (time < last)]
        part = solve_ivp(rates(source), (first, last), state, t_eval=[*inside, last], **options).y
        rows.append(part[:, :-1])
        state = part[:, -1]
    y = np.concatenate(rows, axis=1)
    inside = y[2] / (area(y[0]) if force_kept else 1.0)
    return 1e3 * (y[0] - curve.contracted_m), inside - b * y[1] / area(y[0])


@pytest.mark.parametrize(("slope", "force_kept"), [(0.0, True), (-0.2, True), (-0.2, False), (0.15, True)])
@pytest.mark.parametrize("actuator", ["large", "small"])
def test_step_response_agrees_with_lsoda(actuator, slope, force_kept):
    model = robot.nominal()
    time = np.arange(0.0, 8.0, 0.01)
    command = np.where((time >= ON_S) & (time < OFF_S), 1.0, 0.0)
    displacement, pressure = _lsoda_step(model, actuator, time, slope, force_kept)
    if slope:
        model = model.with_effects({"area_variation": {"slope": slope, "force_kept": float(force_kept)}})
    record = simulate.step_response(model, actuator, time, command, STEP_PSI, tolerance_m=1e-8)
    np.testing.assert_allclose(record["displacement_mm"], displacement, atol=2e-3)
    np.testing.assert_allclose(record["pressure_psi"], pressure, atol=2e-3)


def test_error_falls_with_the_tolerance():
    model = robot.nominal()
    exact = simulate.step_response(model, "large", tolerance_m=1e-11)["displacement_mm"]
    errors = [
        np.abs(simulate.step_response(model, "large", tolerance_m=t)["displacement_mm"] - exact).max()
        for t in (1e-5, 1e-6, 1e-7, 1e-8)
    ]
    assert all(later < 0.4 * earlier for earlier, later in pairwise(errors))
    assert errors[-1] < 1e-3


def test_static_loading_is_spring_minus_pressure():
    model = robot.nominal()
    time = np.arange(0.0, 20.0, 0.02)
    path = np.interp(time, [0.0, 10.0, 20.0], [0.0, 50.0, 0.0])
    for pressure in (0.0, 4.0, 8.5):
        record = simulate.static_loading(model, "large", time, path, pressure)
        curve = model.body_stiffness
        expected = curve.force(curve.contracted_m + path / 1e3) - model["body_area_N_psi"] * pressure
        np.testing.assert_allclose(record["force_N"], expected, atol=1e-4)
        np.testing.assert_allclose(record["pressure_psi"], pressure, atol=1e-9)


def test_anchor_holds_what_the_paper_says_and_slides_with_less():
    model = robot.nominal()
    time = np.arange(0.0, 2.0, 1e-3)
    for pressure, holds in ((8.5, 33.0), (0.0, 5.0)):
        force = simulate.anchor_pull(model, time, 20.0, pressure)["force_N"]
        assert force.max() == pytest.approx(holds, abs=0.15)
        assert force[-1] == pytest.approx(holds * model["mu_k"] / model["mu_s"], abs=0.03)
        assert force[10] == pytest.approx(5000.0 * 0.020 * time[10])


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda m: simulate.step_response(m, "medium"), "medium"),
        (lambda m: simulate.step_response(m, "large", [0.0, np.nan], [0, 0]), "numbers"),
        (lambda m: simulate.step_response(m, "large", [0.0, 1.0], [0]), "one command"),
        (lambda m: simulate.static_loading(m, "large", [0.0, 1.0], [0.0], 1.0), "one finite displacement"),
        (lambda m: simulate.static_loading(m, "large", [0.0, 1.0], [0.0, 1.0], 99.0), "-15 to 15"),
        (lambda m: simulate.anchor_pull(m, [0.0, 1.0], 0.0, 8.5), "rate"),
        (lambda m: simulate.walk(m), "gait"),
        (lambda m: simulate.walk(m, robot.BASELINE, time_s=[1.0, 0.5]), "decrease"),
        (lambda m: simulate.walk(m, robot.BASELINE, inclination_deg=100.0), "-90 to 90"),
        (lambda m: simulate.walk(m, robot.BASELINE, tolerance_m=0.0), "tolerance"),
        (lambda m: simulate.speeds(m, [[5.7, np.nan, 90.0, 0.5, 0.5, 0.5]]), "finite"),
        (lambda m: simulate.speeds(m, [[-5.7, 270.0, 90.0, 0.5, 0.5, 0.5]]), "positive"),
        (lambda m: simulate.Obstacle(0.1, 0.05, 0.08), "97 to 147"),
        (lambda m: simulate.Obstacle(np.nan, 0.05, 0.1), "start = nan"),
        (lambda m: simulate.Obstacle(1e7, 0.05, 0.1), "start"),
        (lambda m: simulate.Obstacle(0.1, np.nan, 0.1), "length = nan"),
        (lambda m: simulate.Obstacle(0.1, 0.05, 0.1, around=-1.0), "0 to 1"),
        (lambda m: simulate.Supports(friction_N=np.nan), "friction = nan"),
        (lambda m: simulate.Supports(buckled_m=0.0), "buckled_m"),
        (lambda m: simulate.Supports(lip_m=-0.02), "lip_m"),
    ],
)
def test_what_cannot_be_simulated_is_refused(call, told):
    with pytest.raises(SimulationError, match=told):
        call(robot.nominal())
