"""What `bifa check` finds in a well-formed data set: defects of the recordings, and mistakes made in the lab."""

from bifa.data import Dataset, Trial

from .finding import Finding
from .plausibility import check_plausibility, check_trial_plausibility
from .recordings import check_recording, check_recordings

__all__ = ["Finding", "check_dataset", "check_trial"]


def check_dataset(dataset: Dataset) -> list[Finding]:
    """Every finding in a data set: defects first."""
    return check_recordings(dataset) + check_plausibility(dataset)


def check_trial(trial: Trial) -> list[Finding]:
    """Every finding in one trial by itself: defects first."""
    return check_recording(trial) + check_trial_plausibility(trial)
