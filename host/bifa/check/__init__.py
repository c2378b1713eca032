"""The checks of `bifa check` on a well-formed data set: defects of recordings, and mistakes made in the lab."""

from bifa.data import Dataset, Trial

from .finding import Finding
from .plausibility import check_plausibility, check_trial_plausibility
from .recordings import check_recording, check_recordings

__all__ = ["Finding", "check_dataset", "check_trial"]


def check_dataset(dataset: Dataset) -> list[Finding]:
    """Return all findings in a data set, defects first."""
    return check_recordings(dataset) + check_plausibility(dataset)


def check_trial(trial: Trial) -> list[Finding]:
    """Return all findings in a single trial, defects first."""
    return check_recording(trial) + check_trial_plausibility(trial)
