"""The plant alone: the paper's walk, friction, springs, air, and the integrator's convergence."""

import numpy as np
import pytest

from virtual_robot.effects import EFFECTS, plant_parameters
from virtual_robot.gait import BASELINE, ROBUST, Gait
from virtual_robot.plant import NOMINAL, Plant, PlantParameterError, nominal_curves, profile


def walk(gait: Gait, cycles: int, parameters=NOMINAL, step_s: float | None = None) -> np.ndarray:
    """Record of a walk, at 100 Hz."""
    plant = Plant(parameters)
    plant.mount("locomotion")
    if step_s is not None:
        plant.set_step(step_s)
    for switch in gait.switches(cycles * gait.period_s):
        plant.connect(*switch)
    return plant.record(np.arange(round(cycles * gait.period_s * 100) + 1) / 100)


def settled_speed_mm_s(gait: Gait, cycles: int, parameters=NOMINAL) -> float:
    rows = walk(gait, cycles, parameters)
    x = np.interp(np.array([cycles - 3, cycles]) * gait.period_s, rows["time_s"], rows["head_m"])
    return 1e3 * float(x[1] - x[0]) / (3 * gait.period_s)


def test_the_baseline_walks_as_in_the_paper_and_the_other_gait_twice_as_fast():
    assert settled_speed_mm_s(BASELINE, 6) == pytest.approx(10.8, abs=0.1)
    assert settled_speed_mm_s(ROBUST, 10) == pytest.approx(21.9, abs=0.2)


def test_the_step_is_far_finer_than_the_noise():
    coarse, fine = walk(BASELINE, 2), walk(BASELINE, 2, step_s=2e-5)
    assert np.abs(coarse["head_m"] - fine["head_m"]).max() < 5e-6  # camera noise: 1e-4
    assert np.sqrt(np.mean((coarse["pressure_psi"] - fine["pressure_psi"]) ** 2)) < 2e-3  # sensor: 0.06


def test_the_same_trial_twice_is_the_same_to_the_bit():
    assert walk(ROBUST, 2).tobytes() == walk(ROBUST, 2).tobytes()


def test_energy_only_goes_down_without_air():
    """Released beyond the unstable point and vented, the spring snaps over and all its energy is dissipated."""
    plant = Plant(NOMINAL)
    plant.mount("step_response", "body", "vacuum")
    plant.connect(0.0, "body", "off")
    energy = []
    for k in range(400):
        plant.record([k * 0.005 + 0.5])
        energy.append(plant.energy_joule)
    assert energy[0] > 0
    # The chamber still empties during the snap; from then on nothing adds energy.
    assert np.all(np.diff(energy[100:]) <= 1e-9)


def test_friction_holds_a_half_exactly_still():
    rows = walk(BASELINE, 3)
    sticking = (rows["sliding_tail"][1:] == 0) & (rows["sliding_tail"][:-1] == 0)
    moved = np.abs(np.diff(rows["tail_m"]))[sticking]
    assert sticking.mean() > 0.3
    assert np.median(moved) == 0.0


def test_anchoring_force_is_that_of_the_paper():
    for pressure, force in ((8.5, 33.0), (0.0, 5.0)):
        plant = Plant(NOMINAL | {"supply_positive_psi": pressure})
        plant.mount("anchor_pull", "head", "positive" if pressure else "off")
        plant.move(0.0, 0.03, 0.02, there_and_back=False)
        pulled = plant.record(np.arange(3000) / 2000)["force_N"]
        assert pulled.max() == pytest.approx(force, abs=0.1)
        assert pulled[-1] == pytest.approx(pulled.max() * NOMINAL["mu_k"] / NOMINAL["mu_s"], abs=0.1)


def test_static_loading_is_the_spring_less_the_pressure_force():
    plant = Plant(NOMINAL | {"supply_positive_psi": 5.0})
    plant.mount("static_loading", "body", "positive")
    plant.move(0.0, 0.05, 0.005, there_and_back=True)
    rows = plant.record(np.arange(1001) / 50)
    expected = plant.spring_force(False, rows["crosshead_m"] + plant.landmarks_m(False)[0])
    expected -= NOMINAL["body_area_N_psi"] * rows["pressure_psi"][:, 0]
    np.testing.assert_allclose(rows["force_N"], expected, atol=1e-9)
    assert rows["pressure_psi"][:, 0] == pytest.approx(5.0, abs=1e-6)


def test_the_spring_has_its_equilibria_where_the_paper_has_them():
    plant = Plant()
    contracted, unstable, extended = plant.landmarks_m(False)
    assert abs(contracted) < 1e-6
    assert 0.45 < unstable / extended < 0.55
    assert extended == pytest.approx(0.0535, abs=5e-4)
    body, _ = nominal_curves()
    np.testing.assert_allclose(plant.spring_force(False, body.displacement_m), body.force_N, atol=1e-6)


def test_a_chamber_fills_as_eq_2_says():
    plant = Plant()
    plant.mount("static_loading", "body", "off")
    plant.connect(0.0, "body", "positive")
    time = np.arange(200) / 100
    rows = plant.record(time)
    expected = 8.5 * (1 - np.exp(-NOMINAL["body_alpha_n_per_s"] * time))
    np.testing.assert_allclose(rows["pressure_psi"][:, 0], expected, atol=1e-6)


def test_a_later_command_overtakes_a_late_valve():
    plant = Plant(NOMINAL | plant_parameters({"valve_asymmetry": {"difference_s": 0.2}}))
    plant.mount("step_response", "body", "vacuum")
    plant.connect(0.10, "body", "positive")  # would act at 0.30
    plant.connect(0.15, "body", "vacuum")  # acts at once
    assert set(plant.record(np.arange(60) / 100)["connected"][:, 0]) == {2}


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_changes_what_is_measured(name):
    def record(parameters):
        rows = [walk(ROBUST, 2, parameters)]
        for mount in (("step_response", "body", "vacuum"), ("anchor_pull", "head", "positive")):
            plant = Plant(parameters | {"session_share": 1.0})
            plant.mount(*mount)
            plant.connect(0.1, mount[1], "positive")
            plant.move(0.0, 0.06, 0.02, there_and_back=False)
            rows.append(plant.record(np.arange(300) / 100))
        return np.concatenate(rows)

    plain, changed = record(NOMINAL), record(NOMINAL | plant_parameters({name: {}}))
    difference = max(np.abs(plain[c] - changed[c]).max() / s for c, s in CHANNELS.items())
    assert difference > 3.0


CHANNELS = {"head_m": 1e-4, "tail_m": 1e-4, "force_N": 0.15, "pressure_psi": 0.06}  # channels and their noise


def test_a_worn_robot_walks_too_and_its_air_is_compressible():
    assert settled_speed_mm_s(Gait(8.0, 270.0, 90.0, 0.5, 0.5, 0.5), 4, profile("worn")) > 3.0


def test_unknown_names_are_refused():
    with pytest.raises(PlantParameterError, match="no parameter 'mass'"):
        Plant({"mass": 1.0})
    with pytest.raises(PlantParameterError, match="no effect 'magic'"):
        plant_parameters({"magic": {}})
    with pytest.raises(PlantParameterError, match="hysteresis has no parameter size"):
        plant_parameters({"hysteresis": {"size": 1.0}})
    with pytest.raises(PlantParameterError, match="no profile"):
        profile("perfect")
