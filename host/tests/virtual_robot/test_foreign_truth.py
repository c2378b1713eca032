"""The foreign truth: physics against limits and the plant's implementation, data against the contract."""

import tomllib

import numpy as np
import pytest

from bifa.check import check_dataset
from bifa.data import read_dataset
from virtual_robot.gait import BASELINE
from virtual_robot.instruments.sensors import colored, flicker
from virtual_robot.plant import Curve, Plant
from virtual_robot.sealed import main
from virtual_robot.truths.foreign import generate
from virtual_robot.truths.foreign.day import Day, draw_names
from virtual_robot.truths.foreign.effects import EFFECTS, LIBRARY, OUTSIDE, REMEMBERING
from virtual_robot.truths.foreign.robot import draw_robot, spring_force
from virtual_robot.truths.foreign.trial import CHAMBERS, Edge, run, spring_newton, throat_psi_s

NOISE = {"displacement": 0.09, "force": 0.17, "pressure": 0.075}  # mm, N, psi: in the middle of the ranges drawn from
FORMS = [(name, form) for name, effect in EFFECTS.items() for form in effect.forms]


@pytest.fixture(scope="module")
def robot() -> dict:
    return draw_robot(np.random.default_rng(1))


def walk(robot: dict, cycles: int = 2, **trial) -> np.ndarray:
    edges = [Edge(*switch) for switch in BASELINE.switches(cycles * BASELINE.period_s)]
    times = np.arange(round(cycles * BASELINE.period_s * 100) + 1) / 100
    return run(robot, {"experiment": "locomotion", **trial}, edges, times).rows


def step(robot: dict, chamber: str = "body", end_s: float = 8.0, **trial) -> np.ndarray:
    edges = [Edge(0.4, chamber, "positive"), Edge(4.0, chamber, "vacuum")]
    trial = {"experiment": "step_response", "chamber": chamber, "start": "vacuum", **trial}
    return run(robot, trial, edges, np.arange(round(end_s * 100) + 1) / 100).rows


# --- physics ----------------------------------------------------------------------------------------------------


def test_an_undamped_snap_conserves_energy(robot):
    """Inflated past the snap and vented, it swings through both stable states forever without a damper."""
    edges = [Edge(0.0, "body", "positive"), Edge(0.4, "body", "off")]
    trial = {"experiment": "step_response", "start": "off", "frictionless": True, "tolerance": 0.01}
    rows = run(robot, trial, edges, np.linspace(0.0, 13.0, 1301)).rows[1201:]  # the last second, when no air is left
    assert rows["head_m"].min() < 0.0 < robot["spring"][0]["extended_m"] < rows["head_m"].max()
    assert np.ptp(rows["energy_J"]) < 1e-4 * rows["energy_J"].mean()


def test_what_sticks_does_not_move_at_all(robot):
    rows = walk(robot)
    for name, end in (("head_m", 0), ("tail_m", 1)):
        still = (rows["sliding"][1:, end] == 0) & (rows["sliding"][:-1, end] == 0)
        moved = np.abs(np.diff(rows[name]))[still]
        assert still.mean() > 0.3
        assert np.median(moved) == 0.0


def test_a_pull_holds_up_to_static_friction_and_then_slides_at_kinetic(robot):
    trial = {"experiment": "anchor_pull", "chamber": "head", "start": "positive", "travel_m": 0.06, "rate_m_s": 0.02}
    rows = run(robot, trial, [], np.arange(6000) / 2000).rows
    force = rows["force_N"]
    top = int(np.argmax(force))
    pulled = robot["load_cell_N_m"] * rows["crosshead_m"]
    np.testing.assert_allclose(force[:top], pulled[:top], atol=1e-9)
    assert force[top + 1 :].max() / force[top] == pytest.approx(robot["mu_k"] / robot["mu_s"], rel=2e-3)


def test_the_throat_keeps_the_limits_of_iso_6358():
    conductance, critical = 0.9, 0.35
    up = 8.5 + 14.7
    choked = throat_psi_s(conductance, critical, 8.5, critical * up - 14.7)
    assert choked == pytest.approx(conductance * up)
    assert throat_psi_s(conductance, critical, 8.5, -14.7) == pytest.approx(choked)  # constant below the critical ratio
    assert throat_psi_s(conductance, critical, 8.5, 8.5) == 0.0
    half = 14.7 * 0.0 + (critical + 0.5 * (1 - critical)) * up - 14.7  # half way along the quarter of an ellipse
    assert throat_psi_s(conductance, critical, 8.5, half) == pytest.approx(choked * np.sqrt(0.75))
    assert throat_psi_s(conductance, critical, half, 8.5) == pytest.approx(-choked * np.sqrt(0.75))


def test_a_wide_throat_is_no_throat(robot):
    plain = step(robot)
    wide = step(robot | {"throat_per_s": 1e3, "throat_ratio": 0.3})
    assert np.abs(plain["head_m"] - wide["head_m"]).max() < 2e-5
    narrow = step(robot | {"throat_per_s": 0.3, "throat_ratio": 0.3})
    filling = np.diff(narrow["pressure_psi"][:, 0])[45:60] * 100
    assert filling.max() <= 0.3 * (robot["positive_psi"] + 14.7) + 0.5


def test_slow_memory_forgets_and_plastic_memory_does_not(robot):
    creeping = robot | {"creep_m_s": 3e-5, "creep_psi": 3.0, "creep_limit_m": 4e-3}
    trial = {"experiment": "step_response", "start": "vacuum", "crept_m": (0.0, 0.0)}
    edges = [Edge(0.4, "body", "positive"), Edge(4.0, "body", "vacuum")]
    first = run(creeping, trial, edges, np.arange(800) / 100)
    second = run(creeping, trial | {"crept_m": first.crept_m}, edges, np.arange(800) / 100)
    assert 0.0 < first.crept_m[0] < second.crept_m[0] < 4e-3
    relaxing = robot | {"prony_N_m": [300.0, 0.0], "prony_s": [0.5, 0, 0, 0, 0], "prony_share": [1.0, 0, 0, 0, 0]}
    assert abs(step(relaxing)["head_m"][-1] - step(robot)["head_m"][-1]) < 1e-4


def test_the_usual_tolerance_lies_far_under_the_noise(robot):
    hard = {"bouc_N": [4.0, 1.0], "bouc_m": 0.002, "bouc_beta": 0.7, "bouc_power": 2.0, "line_form": 2, "line_s": 0.04}
    for rows in (lambda t: walk(robot | hard, tolerance=t), lambda t: step(robot | hard, "head", tolerance=t)):
        usual, half, tight = rows(1.0), rows(0.5), rows(0.01)
        for looser in (usual, half):
            assert np.abs(looser["head_m"] - tight["head_m"]).max() < 2e-5  # the camera's noise is 9e-5
            difference = looser["pressure_psi"] - tight["pressure_psi"]
            assert np.sqrt(np.mean(difference**2)) < 1.5e-3  # the sensor's noise is 0.07


def plant_of(robot: dict) -> Plant:
    """The plant with the same parameters, its springs tabulated from the truss."""
    curves = []
    for small, (low, high) in enumerate(((-0.008, 0.064), (-0.005, 0.037))):
        x = np.linspace(low, high, 250)
        curves.append(Curve(low, x[1] - x[0], spring_force(robot["spring"][small], x)))
    numbers = {
        "head_mass_kg": robot["half_mass_kg"][0],
        "tail_mass_kg": robot["half_mass_kg"][1],
        "head_segment_mass_kg": robot["segment_mass_kg"],
        "small_mass_kg": robot["small_mass_kg"],
        "wall_offset_m": robot["wall_offset_m"],
        "wall_stiffness_N_m": robot["wall_N_m"],
        "wall_damping_Ns_m": robot["wall_Ns_m"],
        "supply_positive_psi": robot["positive_psi"],
        "supply_negative_psi": robot["negative_psi"],
        **{name: robot[name] for name in ("mu_s", "mu_k", "load_cell_N_m", "friction_factor")},
    }
    for k, chamber in enumerate(("body", "small")):
        for name in ("damping_Ns_m", "area_N_psi", "alpha_n_per_s", "alpha_s_per_s"):
            numbers[f"{chamber}_{name}"] = robot[name][k]
    return Plant(numbers, tuple(curves))


def test_without_effects_two_implementations_walk_alike(robot):
    plant = plant_of(robot)
    plant.mount("locomotion")
    for switch in BASELINE.switches(2 * BASELINE.period_s):
        plant.connect(*switch)
    ours = walk(robot)
    theirs = plant.record(np.arange(len(ours)) / 100)
    for name in ("head_m", "tail_m"):
        assert np.abs(ours[name] - theirs[name]).max() < 6e-5
    for c, _ in enumerate(CHAMBERS):
        assert np.sqrt(np.mean((ours["pressure_psi"][:, c] - theirs["pressure_psi"][:, c]) ** 2)) < 0.02


def test_without_effects_two_implementations_step_alike(robot):
    alike = robot | {"stand_mass_kg": robot["half_mass_kg"][0]}  # on the plant's stand, half the robot moves
    for chamber in ("body", "head"):
        plant = plant_of(alike)
        plant.mount("step_response", chamber, "vacuum")
        plant.connect(0.4, chamber, "positive")
        plant.connect(4.0, chamber, "vacuum")
        ours = step(alike, chamber)
        theirs = plant.record(np.arange(len(ours)) / 100)
        zero = plant.landmarks_m(chamber != "body")[0]
        assert np.abs(ours["head_m"] - theirs["head_m"] - zero).max() < 6e-5


def test_the_truss_is_the_same_in_c_and_python_and_the_papers_polynomial_can_hold_it():
    for seed in range(5):
        robot = draw_robot(np.random.default_rng(seed))
        for small, (low, high) in enumerate(((-0.006, 0.0598), (-0.004, 0.034))):
            x = np.linspace(low, high, 800)
            force = spring_force(robot["spring"][small], x)
            np.testing.assert_allclose(spring_newton(robot, bool(small), x), force, atol=1e-9)
            fitted = np.polynomial.Chebyshev.fit(x, force, 15)
            assert np.abs(fitted(x) - force).max() < 0.05  # a third of the load cell's noise: eq. (1) describes it


def test_friction_that_depends_on_speed_and_direction_never_slides_harder_than_it_sticks(robot):
    """Kinetic friction never exceeds static friction, which would make the robot stick and slip forever."""
    both = robot | {"stribeck_form": 1, "stribeck_m_s": 0.008, "direction_static": 0.07, "direction_kinetic": 0.13}
    assert walk(both)["head_m"][-1] > 0.02


# --- effects ----------------------------------------------------------------------------------------------------


def test_every_mechanism_of_the_contract_has_another_form_and_eight_and_more_are_in_no_library():
    assert len(LIBRARY) == 18
    assert len(OUTSIDE) >= 8
    assert len(REMEMBERING) >= 3
    assert not set(LIBRARY) & set(OUTSIDE)


@pytest.fixture(scope="module")
def plain_day() -> tuple[Day, dict]:
    day = Day.draw(5, "none")
    return day, day.run()


@pytest.mark.parametrize(("name", "form"), FORMS)
def test_every_form_of_every_effect_shows_in_the_data_of_the_same_day(plain_day, name, form):
    plain, columns = plain_day
    changed = Day.draw(5, "none", effect=name, size=0.5, form=form)
    last_of_each = {job for job, (_, repeat) in enumerate(plain.jobs) if repeat == 1}
    wanted = None if name == "pouch_creep" else last_of_each
    greatest = 0.0
    for job, seen in changed.run(wanted).items():
        for column, values in seen.items():
            noise = next((sd for kind, sd in NOISE.items() if column.startswith(kind)), None)
            if noise is not None:
                greatest = max(greatest, float(np.sqrt(np.mean((values - columns[job][column]) ** 2))) / noise)
    assert greatest > 1.0


def test_kinds_draw_what_they_say():
    random = np.random.default_rng(0)
    drawn = {kind: [draw_names(kind, random) for _ in range(300)] for kind in ("none", "one", "pair", "outside")}
    assert not any(drawn["none"])
    assert {name for names in drawn["one"] for name in names} == set(LIBRARY)
    assert {name for names in drawn["outside"] for name in names} == set(OUTSIDE)
    assert all(len(set(names)) == 2 for names in drawn["pair"])


def test_noise_is_colored_as_it_says():
    random = np.random.default_rng(0)
    noise = colored(0.2, 0.6, 40000, random)
    assert noise.std() == pytest.approx(0.2, rel=0.03)
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(0.6, abs=0.02)
    power = np.abs(np.fft.rfft(flicker(1.0, 2**16, random))) ** 2
    frequency = np.arange(len(power))
    bands = [power[(frequency >= f) & (frequency < 2 * f)].mean() for f in (64, 4096)]
    assert 25 < bands[0] / bands[1] < 160  # 64 for exact 1/f noise


# --- data sets --------------------------------------------------------------------------------------------------


def test_a_data_set_is_read_without_a_complaint_and_says_nothing_of_what_is_in_it(tmp_path):
    label = generate(3, tmp_path / "day", "pair")
    data = read_dataset(tmp_path / "day")
    assert len(data.trials) == 48
    assert not check_dataset(data)
    assert sorted(trial.session_order for trial in data.trials) == list(range(1, 49))
    assert set(data.known) == {"head_mass_kg", "tail_mass_kg", "supply_positive_psi", "supply_negative_psi"}
    assert len({trial.condition for trial in data.trials}) == 16
    for file in (tmp_path / "day").iterdir():
        text = file.read_text()
        assert not any(name in text for name in (*EFFECTS, "foreign"))
    sealed = tomllib.loads((tmp_path / "day.sealed.toml").read_text())
    assert set(sealed["effects"]) == set(label.effects)
    assert all(0.5 <= size <= 1.0 for size in sealed["sizes"].values())


def test_a_seed_is_a_data_set_to_the_byte(tmp_path):
    for name in ("a", "b"):
        assert main(["--truth", "foreign", "--seed", "11", "--out", str(tmp_path / name)]) == 0
    files = sorted(file.name for file in (tmp_path / "a").iterdir())
    assert len(files) == 49
    assert all((tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes() for file in files)
    assert (tmp_path / "a.sealed.toml").read_bytes() == (tmp_path / "b.sealed.toml").read_bytes()


def test_the_command_names_what_it_does_not_know(tmp_path, capsys):
    foreign = ["--truth", "foreign", "--seed", "1", "--out", str(tmp_path / "new")]
    assert main([*foreign, "--effect", "magic"]) == 2
    assert "no effect 'magic'; there are hysteresis" in capsys.readouterr().err
    assert main([*foreign, "--effect", "leak", "--form", "magic"]) == 2
    assert "leak has no form 'magic'; there are orifice" in capsys.readouterr().err
    assert main(["--seed", "1", "--out", str(tmp_path / "new"), "--effect", "leak", "--form", "orifice"]) == 2
    assert "--form needs --truth foreign" in capsys.readouterr().err
    (tmp_path / "there").mkdir()
    assert main(["--truth", "foreign", "--seed", "1", "--out", str(tmp_path / "there")]) == 2
    assert "never overwritten" in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["there"]
