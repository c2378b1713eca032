"""Hold the words of docs/glossary.md: python tools/names.py. Identifiers use the field's, in American spelling; a class
has its name to itself."""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("host/bifa", "host/lacuna", "host/virtual_robot", "host/harness", "host/benchmarks", "schema", "tools")
LEFT_OUT = ("tools/stand_ins",)  # in the place of others' files
OURS = (
    "host/bifa",
    "host/lacuna",
    "host/harness",
    "host/benchmarks",
)  # the virtual robot is another world, which may say Plant as well
PRIVATE = {  # a word of ours: the field's
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
    """Say where an identifier has a word that is not the field's, and which classes share a name."""
    files = [path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]
    found = [fault for path in files if not _is_left_out(path) for fault in faults_of(path.read_text("utf-8"), path)]
    found += twice({path: path.read_text("utf-8") for room in OURS for path in sorted((ROOT / room).rglob("*.py"))})
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


def _is_left_out(path: Path) -> bool:
    return path.relative_to(ROOT).as_posix().startswith(LEFT_OUT)


def faults_of(source: str, path: Path) -> list[str]:
    """What is wrong with the identifiers of a file."""
    found = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        for word in _WORD.findall(token.string) if token.type == tokenize.NAME else ():
            if word.lower() in PRIVATE:
                found.append(
                    f"{path}:{token.start[0]}: {token.string}: {word} is {PRIVATE[word.lower()]}, docs/glossary.md"
                )
            elif BRITISH.search(word.lower()):
                found.append(f"{path}:{token.start[0]}: {token.string}: identifiers are in American spelling")
    return found


def twice(sources: Mapping[Path, str]) -> list[str]:
    """Public classes whose name another class has, in these files."""
    first: dict[str, Path] = {}
    found = []
    for path, source in sources.items():
        classes = [node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)]
        for node in classes:
            if not node.name.startswith("_") and (other := first.setdefault(node.name, path)) != path:
                found.append(f"{path}:{node.lineno}: the class {node.name} is another in {other}")
    return found


if __name__ == "__main__":
    sys.exit(main())
