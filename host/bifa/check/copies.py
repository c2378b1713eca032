"""The same record in two trials, as a file was saved, named or copied twice: no two recordings have the same noise."""

from collections.abc import Collection, Iterator

import numpy as np

from bifa.check.finding import Finding
from bifa.data import Dataset


def check_copies(dataset: Dataset, skipped: Collection[str] = ()) -> Iterator[Finding]:
    """Trials whose displacement or force is that of an earlier one of the experiment; `skipped`: files told of."""
    first: dict[tuple[str, str, bytes], str] = {}
    for trial in (trial for trial in dataset.trials if trial.file not in skipped):
        for name, values in trial.columns.items():
            if not name.startswith(("displacement", "force")) or np.ptp(values) == 0.0:
                continue
            earlier = first.setdefault((trial.experiment, name, values.tobytes()), trial.file)
            if earlier != trial.file:
                text = f"has the same {name} as {earlier}, sample by sample: give its own record, or leave it out"
                yield Finding("copy", text, trial.file, column=name)
                break
