"""Do 90 % intervals contain the truth nine times in ten? On data of the model itself, with white noise."""

from dataclasses import replace

import numpy as np
import pytest

from bifa.characterisation.identification import identify
from bifa.data import Dataset, Trial
from bifa.robot import nominal
from bifa.simulate import static_loading, step_response, timeline

NAMES = ("body_damping_Ns_m", "body_area_N_psi", "body_alpha_n_per_s", "body_alpha_s_per_s")
NOISE = {"force_N": 0.15, "displacement_mm": 0.1, "pressure_psi": 0.06}


def records():
    """Noise-free static loadings and steps of the large actuator, as (trial fields, columns)."""
    model = nominal()
    half = 53.6 / 4.0
    time_s = np.arange(0.0, 2 * half, 0.02)
    path = np.where(time_s < half, time_s, 2 * half - time_s) * 4.0
    for pressure in (0.0, 4.0, 8.0):
        fields = {"experiment": "static_loading", "actuator": "large", "pressure_psi": pressure, "rate_mm_s": 4.0}
        yield fields, dict(static_loading(model, "large", time_s, path, pressure).columns)
    time_s = np.arange(1100) * 0.01
    switches = timeline([(0.0, 0, 0), (0.5, 0, 1), (5.0, 0, 0)])
    for pressure in (6.5, 8.5):
        fields = {"experiment": "step_response", "actuator": "large", "pressure_psi": pressure}
        yield fields, dict(step_response(model, "large", time_s, switches, pressure, 1e-7).columns)


def noisy(clean, seed) -> Dataset:
    """Every record twice, with noise of its own."""
    rng = np.random.default_rng(seed)
    trials = []
    for repeat in (1, 2):
        for fields, columns in clean:
            measured = {
                name: values
                if name not in NOISE or (name == "displacement_mm" and fields["experiment"] == "static_loading")
                else values + NOISE[name] * rng.standard_normal(values.shape)
                for name, values in columns.items()
            }
            trials.append(Trial(f"{len(trials):02d}.csv", columns=measured, repeat=repeat, **fields))
    known = {"head_mass_kg": 0.175, "tail_mass_kg": 0.175, "supply_negative_psi": -13.0}
    return Dataset(path=None, name="coverage", known=known, trials=tuple(trials))


def coverage(seeds) -> tuple[float, dict[str, float]]:
    """Share of intervals that contain the truth, and the mean error of each parameter in its standard deviations."""
    clean = list(records())
    truth = nominal()
    hits, errors = [], {name: [] for name in NAMES}
    for seed in seeds:
        found = identify(noisy(clean, seed), replace(truth, name="start"))
        for name in NAMES:
            interval = found.intervals[name]
            hits.append(interval.covers(truth[name]))
            errors[name].append((interval.value - truth[name]) / interval.sd)
    return float(np.mean(hits)), {name: float(np.mean(values)) for name, values in errors.items()}


def test_intervals_on_ideal_data_contain_the_truth():
    share, _ = coverage(range(3))
    assert share >= 0.5  # 12 intervals of 90 %: fewer than 6 hits would be a chance of 1 in 20,000


@pytest.mark.soak
def test_intervals_on_a_hundred_data_sets_contain_the_truth_nine_times_in_ten():
    share, errors = coverage(range(100, 200))
    print(f"coverage of 90 % intervals over 100 data sets: {share:.3f}; mean errors in sd: {errors}")
    assert 0.85 <= share <= 0.97
