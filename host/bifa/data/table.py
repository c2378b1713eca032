"""What the columns of a trial may be called, and what their values may be."""

from collections.abc import Mapping

import numpy as np

from .layout import Layout, is_command
from .sheet import Sheet

LARGEST = 1e12  # in any unit: no measurement, and small enough to be squared and averaged
SHORTEST_STEP_S = 1e-6


def check_header(sheet: Sheet, layout: Layout) -> None:
    """Raise DatasetError for what is no header of a file in the data set's own form: it has the columns of the
    experiment, each once, and no other."""
    names, expected = sheet.labels(), f"the columns of this experiment are {', '.join(layout.all_columns)}"
    for place, name in enumerate(names):
        if name.startswith("#"):
            raise sheet.error('begins with #, as numpy.savetxt writes it; have it written with comments=""', -1, name)
        if name not in layout.all_columns:
            raise sheet.error(f"unknown column {name!r}; {expected}", -1, name or "(no name)")
        if name in names[:place]:
            raise sheet.error("the column appears twice in the header", -1, name)
    for name in layout.columns:
        if name not in names:
            raise sheet.error(f"the column is missing from the header; {expected}", -1, name)


def check_values(columns: Mapping[str, np.ndarray], sheet: Sheet, rows: np.ndarray, named: Mapping[str, str]) -> None:
    """Raise DatasetError for what cannot have been measured. Columns have the shape of `rows`, those of the sheet that
    they are from; `named`: what the file calls a column, where that is another name."""

    def refuse(name: str, wrong: np.ndarray, problem: str) -> None:
        """`problem` is filled in with the first `value` that is wrong, the one `before`, and the `step` between."""
        if wrong.any():
            row = int(np.argmax(wrong))
            value, before = (float(columns[name][at]) for at in (row, row - 1))
            said = problem.format(value=value, before=before, step=value - before)
            raise sheet.error(said, int(rows[row]), named.get(name, name))

    if len(rows) < 2:
        raise sheet.error(f"{len(rows)} rows of data; at least two are needed", len(sheet) - 1)
    for name, values in columns.items():
        refuse(name, np.isnan(values), "the value is missing")
        refuse(name, np.abs(values) > LARGEST, f"{{value:g}} is beyond any measurement (largest: {LARGEST:g})")
        if is_command(name):
            refuse(name, (values != 0) & (values != 1), "command {value:g} is neither 1 (positive) nor 0 (vacuum)")
    step_s = np.diff(columns["time_s"], prepend=-np.inf)
    refuse("time_s", step_s < 0, "time goes backwards: {value} after {before}")
    refuse("time_s", step_s == 0, "time stands still: {value} after {before}")
    too_short = f"time advances by {{step:g}} s, less than the minimum of {SHORTEST_STEP_S:g} s"
    refuse("time_s", step_s < SHORTEST_STEP_S, too_short)
