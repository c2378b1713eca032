"""Findings of the checks. Similar findings in several trials are merged, with the range of the numbers that differ."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

MIN_MERGED = 3  # smallest number of findings that are merged
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.]*\w)")  # separate numbers, not those in a file's name


@dataclass(frozen=True)
class Finding:
    """One result of a check. `file` is None if it concerns the whole data set, several `files`, or the repeats of one
    `condition`; `line` is a line of the CSV file."""

    kind: str
    text: str
    file: str | None = None
    line: int | None = None
    column: str | None = None
    files: tuple[str, ...] = ()
    condition: str | None = None

    @property
    def place(self) -> str:
        """The file with its line, or the condition; empty if the finding concerns the whole data set."""
        if self.condition:
            return self.condition
        return ", ".join(part for part in (self.file, f"line {self.line}" if self.line else None) if part)

    def __str__(self) -> str:
        where = ", ".join(part for part in (self.place, self.column) if part)
        return f"{where}: {self.text}" if where else self.text


def merge_findings(findings: Sequence[Finding]) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Merge findings that differ only in numbers and place. Yields kind, text and places (none for a single finding) in
    order of first appearance."""
    alike: dict[tuple[str, str | None, str], list[Finding]] = {}
    for finding in findings:
        alike.setdefault((finding.kind, finding.column, _NUMBER.sub("", finding.text)), []).append(finding)
    for group in alike.values():
        if len(group) < MIN_MERGED or not all(finding.place for finding in group):
            yield from ((finding.kind, str(finding), ()) for finding in group)
            continue
        column = f", {group[0].column}" if group[0].column else ""
        count = len({finding.file or finding.condition for finding in group})
        what = f"{count} {'trials' if group[0].file else 'conditions'}{column}"
        text = f"{what}: {_merge_texts([finding.text for finding in group])}"
        yield group[0].kind, text, tuple(finding.place for finding in group)


def _merge_texts(texts: Sequence[str]) -> str:
    """Merge texts that differ only in their numbers, giving the lowest and the highest value of each number."""
    numbers = zip(*(_NUMBER.findall(text) for text in texts), strict=True)
    words = _NUMBER.split(texts[0])
    spans = [sorted(set(slot), key=float) for slot in numbers]
    ranges = [span[0] if len(span) == 1 else f"{span[0]} to {span[-1]}" for span in spans]
    return "".join(word + number for word, number in zip(words, [*ranges, ""], strict=True))
