"""The one error of this package: it says which file, line and column is at fault."""

from bifa.errors import BifaError
from bifa.printable import printable


class DatasetError(BifaError):
    """A data set cannot be read or written.

    `file` is relative to the data set, `line` counts from 1, `column` is a column's name in a CSV file or
    a key in dataset.toml; each is None where it has no meaning. `problem` is the sentence without the place.
    """

    def __init__(self, problem: str, *, file: str | None = None, line: int | None = None, column: str | None = None):
        self.problem, self.file, self.line, self.column = problem, file, line, column
        place = [
            file,
            None if line is None else f"line {line}",
            None if column is None else f"column {column}" if not str(file).endswith(".toml") else column,
        ]
        found = ", ".join(printable(part, keep="") for part in place if part)
        super().__init__(f"{found}: {problem}" if found else problem)
