"""Enforce the words of docs/glossary.md: python tools/names.py. Identifiers use the field's terms, in American
spelling; no two classes share a name."""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("host/bifa", "host/lacuna", "host/virtual_robot", "host/harness", "host/benchmarks", "schema", "tools")
LEFT_OUT = ("tools/stand_ins",)  # in place of other projects' files
OURS = (
    "host/bifa",
    "host/lacuna",
    "host/harness",
    "host/benchmarks",
)  # the virtual robot is independent and may have a Plant of its own
PRIVATE = {  # our private word: the field's
    "afar": "multi_start",
    "afresh": "cold_start",
    "anew": "cold_start",
    "besides": "absorbed",
    "crew": "workers",
    "foreseen": "predictive",
    "foretelling": "predicting",
    "foretold": "predicted",
    "glance": "coarse",
    "mistake": "check",
    "mistakes": "checks",
    "outdone": "dominated",
    "sketch": "coarse",
}
BRITISH = re.compile(
    r"(?:character|custom|discret|final|general|initial|linear|local|maxim|minim|normal|optim|organ|parametr|random|"
    r"recogn|regular|serial|stabil|standard|summar|synchron|util|vector|visual)is(?:e|ed|er|es|ing|ation)$|"
    r"colour|behaviour|neighbour|centre$|licence$|modelled$|labelled$|travelled$"
)
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+")


def main() -> int:
    """Print identifiers with words that are not the field's, and classes that share a name."""
    files = [path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]
    found = [fault for path in files if not _is_left_out(path) for fault in faults_of(path.read_text("utf-8"), path)]
    found += twice({path: path.read_text("utf-8") for room in OURS for path in sorted((ROOT / room).rglob("*.py"))})
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


def _is_left_out(path: Path) -> bool:
    return path.relative_to(ROOT).as_posix().startswith(LEFT_OUT)


def faults_of(source: str, path: Path) -> list[str]:
    """Faults of the identifiers in a file, one line each."""
    found = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        for word in _WORD.findall(token.string) if token.type == tokenize.NAME else ():
            if word.lower() in PRIVATE:
                found.append(
                    f"{path}:{token.start[0]}: {token.string}: {word} is {PRIVATE[word.lower()]}, see docs/glossary.md"
                )
            elif BRITISH.search(word.lower()):
                found.append(f"{path}:{token.start[0]}: {token.string}: identifiers use American spelling")
    return found


def twice(sources: Mapping[Path, str]) -> list[str]:
    """Public classes in these files whose name is also another class's."""
    first: dict[str, Path] = {}
    found = []
    for path, source in sources.items():
        classes = [node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)]
        for node in classes:
            if not node.name.startswith("_") and (other := first.setdefault(node.name, path)) != path:
                found.append(f"{path}:{node.lineno}: the class {node.name} is also defined in {other}")
    return found


if __name__ == "__main__":
    sys.exit(main())
