import pytest

from bifa.data import write_dataset
from harness.data_sets import make_dataset


@pytest.fixture
def folder(tmp_path):
    """A data set on disk with two repeats of every experiment."""
    return write_dataset(tmp_path / "bench", make_dataset())
