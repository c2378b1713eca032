"""The command lines of the README, the docs, the workflows and the container: those in blocks and those in the text."""

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
    """One command: its program without the folder, and its arguments. Of `a && b` each is one."""

    page: str
    program: str
    arguments: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.page}: {shlex.join((self.program, *self.arguments))}"


def command_lines(root: Path) -> list[CommandLine]:
    """All of them, each once a page. What names no argument of `make` or a tool is prose: "`bifa` talks to..."."""
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
    """The files of the workflows."""
    return sorted((root / ".github" / "workflows").glob("*.yml"))


def steps(workflow: Path) -> list[dict]:
    """The steps of all its jobs."""
    return [step for job in yaml.safe_load(workflow.read_text("utf-8"))["jobs"].values() for step in job["steps"]]


def _candidates(text: str) -> Iterator[str]:
    for language, block in _BLOCK.findall(text):
        if language in ("", "sh", "bash", "text"):
            yield from block.splitlines()
    prose = _BLOCK.sub("", text)
    yield from (line for line in prose.splitlines() if line.startswith("    "))
    yield from (" ".join(code.split()) for code in _INLINE.findall(prose))


def _commands(line: str) -> Iterator[list[str]]:
    """The words of each command; optional ones, in brackets, are there, and assignments and `time` are not."""
    line = _COMMENT.sub("", line.strip()).replace("\\", "/")
    for part in re.split(r"&&|;", line):
        part = re.sub(r"^(?:time\s+|[A-Z_]+=\S+\s+)*", "", part.strip())
        if _FIRST.match(part) and "..." not in part:
            words = shlex.split(re.sub(r"(?<=\s)\[(?=-)|(?<=\S)\](?=\s|$)", "", part))
            words[0] = Path(words[0]).name
            if len(words) > 1:
                yield words
