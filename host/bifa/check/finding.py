"""What a check found."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One thing to look at. `file` is None where it concerns the whole data set, or several `files`; `line` is that of
    the CSV file."""

    kind: str
    text: str
    file: str | None = None
    line: int | None = None
    column: str | None = None
    files: tuple[str, ...] = ()

    def __str__(self) -> str:
        place = [self.file, f"line {self.line}" if self.line else None, self.column]
        where = ", ".join(part for part in place if part)
        return f"{where}: {self.text}" if where else self.text
