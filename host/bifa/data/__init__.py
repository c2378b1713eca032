"""Measured data: strict reading and safe writing of data sets."""

from .dataset import Dataset, Trial
from .errors import DatasetError
from .layout import EXPERIMENTS
from .read import read_dataset
from .write import DatasetWriter, write_dataset

__all__ = ["EXPERIMENTS", "Dataset", "DatasetError", "DatasetWriter", "Trial", "read_dataset", "write_dataset"]
