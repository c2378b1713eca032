"""Small data sets for tests to read, corrupt and write."""

from dataclasses import asdict

import numpy as np

from bifa.data import EXPERIMENTS, Dataset, Trial
from bifa.robot import BASELINE

GAIT = BASELINE.as_dict()
SETTINGS = {
    "static_loading": {"actuator": "large", "pressure_psi": 0.0, "rate_mm_s": 2.0},
    "step_response": {"actuator": "small", "pressure_psi": 8.5},
    "anchor_pull": {"pressure_psi": 8.5, "rate_mm_s": 20.0},
    "locomotion": {"gait": GAIT},
}


def make_trial(experiment: str = "locomotion", repeat: int = 1, samples: int = 40, seed: int = 0, **changes):
    """A trial whose columns are a slow movement with noise, and whose commands are 0, then 1."""
    rng = np.random.default_rng([seed, repeat])
    layout = EXPERIMENTS[experiment]
    columns = {}
    for name in layout.columns:
        if name == "time_s":
            columns[name] = np.arange(samples) / layout.rate_hz
        elif name.startswith("command"):
            columns[name] = np.repeat([0.0, 1.0], [samples // 2, samples - samples // 2])
        else:
            columns[name] = np.round(np.linspace(0.0, 12.0, samples) + 0.01 * rng.normal(size=samples), 4)
    settings = {"file": f"{experiment}_{repeat}.csv", "repeat": repeat, **SETTINGS[experiment], **changes}
    return Trial(experiment=experiment, columns=columns, **settings)


def make_dataset(repeats: int = 2) -> Dataset:
    """A data set with `repeats` trials of every experiment."""
    trials = [make_trial(name, repeat) for name in EXPERIMENTS for repeat in range(1, repeats + 1)]
    return Dataset(None, "made for a test", {"head_mass_kg": 0.175}, tuple(trials), {"made_by": "a test"})


def assert_same(left: Dataset, right: Dataset) -> None:
    """Assert that two data sets are equal to the last bit, except for their paths and exports."""
    one, other = ({**asdict(data), "path": None, "exports": None} for data in (left, right))
    np.testing.assert_equal(one, other)
    assert [list(trial["columns"]) for trial in one["trials"]] == [list(t["columns"]) for t in other["trials"]]
