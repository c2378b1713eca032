"""What is found alike in several trials is said once, with the range of the numbers that differ."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .finding import Finding

LEAST = 3  # findings that are gathered
_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.]*\w)")  # by itself: not those in a file's name


@dataclass(frozen=True)
class Gathered:
    """`text`, as a person reads it; `places`: where, one for each finding that was gathered, none for one by itself."""

    kind: str
    text: str
    places: tuple[str, ...] = ()


def gathered(findings: Sequence[Finding]) -> Iterator[Gathered]:
    """What is alike but for its numbers and its place, together; in the order of the first of each."""
    alike: dict[tuple[str, str | None, str], list[Finding]] = {}
    for finding in findings:
        alike.setdefault((finding.kind, finding.column, _NUMBER.sub("", finding.text)), []).append(finding)
    for group in alike.values():
        if len(group) < LEAST or not all(finding.place for finding in group):
            yield from (Gathered(finding.kind, str(finding)) for finding in group)
            continue
        column = f", {group[0].column}" if group[0].column else ""
        text = f"{_count(group)}{column}: {_in_one([finding.text for finding in group])}"
        yield Gathered(group[0].kind, text, tuple(finding.place for finding in group))


def _count(group: Sequence[Finding]) -> str:
    places = {finding.file or finding.condition for finding in group}
    return f"{len(places)} {'trials' if group[0].file else 'conditions'}"


def _in_one(texts: Sequence[str]) -> str:
    """The sentence that these are but for their numbers, with the lowest and the highest of each."""
    numbers = zip(*(_NUMBER.findall(text) for text in texts), strict=True)
    words = _NUMBER.split(texts[0])
    spans = [sorted(set(slot), key=float) for slot in numbers]
    said = [span[0] if len(span) == 1 else f"{span[0]} to {span[-1]}" for span in spans]
    return "".join(word + number for word, number in zip(words, [*said, ""], strict=True))
