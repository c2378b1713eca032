"""The same record in two trials is told."""

from dataclasses import replace

import numpy as np

from bifa.check.copies import check_copies
from bifa.data import Dataset, Trial


def test_a_record_that_stands_in_two_trials_is_told_once():
    columns = {"time_s": np.arange(3.0), "displacement_mm": np.arange(3.0), "force_N": np.zeros(3)}
    first = Trial("one.csv", "anchor_pull", columns, pressure_psi=8.5)
    other = replace(first, file="three.csv", columns={**columns, "displacement_mm": np.arange(3.0) + 1})
    (found,) = check_copies(Dataset(None, "day", {}, (first, replace(first, file="two.csv"), other)))
    assert (found.file, "one.csv" in found.text) == ("two.csv", True)
