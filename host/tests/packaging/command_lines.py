"""Command lines in code blocks and inline code of the README, the docs, the workflows and the container."""

import json
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml

PROGRAMS = ("bifa", "make", "pio", "pip", "python", "pytest")
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
_INLINE = re.compile(r"(?<!`)`([^`]+)`(?!`)")
_COMMENT = re.compile(r"\s+#\s.*")
_FIRST = re.compile(rf"(?:\S*/)?({'|'.join(PROGRAMS)})(?:\s|$)")


@dataclass(frozen=True)
class CommandLine:
    """One command: its program without the folder, and its arguments. `a && b` counts as two commands."""

    page: str
    program: str
    arguments: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.page}: {shlex.join((self.program, *self.arguments))}"


def command_lines(root: Path) -> list[CommandLine]:
    """All command lines, without duplicates on a page. A program without arguments is prose: "`bifa` talks to..."."""
    pages = [root / "README.md", root / "host" / "lacuna" / "README.md", *sorted((root / ".github").glob("*.md"))]
    pages += sorted((root / "docs").rglob("*.md"))
    texts = [(page, text) for page in pages for text in _candidates(page.read_text("utf-8"))]
    texts += [(page, step["run"]) for page in workflows(root) for step in steps(page) if "run" in step]
    container = root / ".devcontainer" / "devcontainer.json"
    texts.append((container, json.loads(container.read_text("utf-8"))["postCreateCommand"]))
    return list(
        dict.fromkeys(
            CommandLine(page.relative_to(root).as_posix(), command[0], tuple(command[1:]))
            for page, text in texts
            for command in _commands(text)
        )
    )


def workflows(root: Path) -> list[Path]:
    """Paths of the workflow files."""
    return sorted((root / ".github" / "workflows").glob("*.yml"))


def steps(workflow: Path) -> list[dict]:
    """Steps of all jobs of a workflow."""
    return [step for job in yaml.safe_load(workflow.read_text("utf-8"))["jobs"].values() for step in job["steps"]]


def _candidates(text: str) -> Iterator[str]:
    for language, block in _BLOCK.findall(text):
        if language in ("", "sh", "bash", "text"):
            yield from block.splitlines()
    prose = _BLOCK.sub("", text)
    yield from (line for line in prose.splitlines() if line.startswith("    "))
    yield from (" ".join(code.split()) for code in _INLINE.findall(prose))


def _commands(line: str) -> Iterator[list[str]]:
    """The words of each command, including optional ones in brackets, without assignments and `time`."""
    line = _COMMENT.sub("", line.strip()).replace("\\", "/")
    for part in re.split(r"&&|;", line):
        part = re.sub(r"^(?:time\s+|[A-Z_]+=\S+\s+)*", "", part.strip())
        if _FIRST.match(part) and "..." not in part:
            words = shlex.split(re.sub(r"(?<=\s)\[(?=-)|(?<=\S)\](?=\s|$)", "", part))
            words[0] = Path(words[0]).name
            if len(words) > 1:
                yield words
