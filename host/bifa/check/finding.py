"""What a check found."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One thing to look at. `file` is None where it concerns the whole data set, several `files`, or the repeats of one
    `condition`; `line` is that of the CSV file."""

    kind: str
    text: str
    file: str | None = None
    line: int | None = None
    column: str | None = None
    files: tuple[str, ...] = ()
    condition: str | None = None

    @property
    def place(self) -> str:
        """The file with its line, or the condition; empty where it concerns the whole data set."""
        if self.condition:
            return self.condition
        return ", ".join(part for part in (self.file, f"line {self.line}" if self.line else None) if part)

    def __str__(self) -> str:
        where = ", ".join(part for part in (self.place, self.column) if part)
        return f"{where}: {self.text}" if where else self.text
