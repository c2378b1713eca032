"""Measured data: the data set's format, read strictly, written safely."""

from .dataset import Dataset, Trial
from .errors import DatasetError
from .layout import EXPERIMENTS
from .read import read_dataset
from .write import DatasetWriter, write_dataset

__all__ = ["EXPERIMENTS", "Dataset", "DatasetError", "DatasetWriter", "Trial", "read_dataset", "write_dataset"]
