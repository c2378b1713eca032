"""The error class of this package, which names the file, line and column at fault."""

from bifa.errors import BifaError
from bifa.printable import printable


class DatasetError(BifaError):
    """A data set cannot be read or written.

    `file` is relative to the data set, `line` counts from 1, `column` is the name of a column in a CSV file or
    a key in dataset.toml; each is None if it does not apply. `problem` is the message without the location.
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
