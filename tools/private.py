"""Check that tests and benchmarks use no private names: python tools/private.py. Names that begin with an underscore
may disappear at any time, and nobody would notice before these programs run."""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
GUESTS = [ROOT / "host" / name for name in ("benchmarks", "harness", "tests")]
PATCHED = re.compile(r"(?:bifa|lacuna|harness|benchmarks|virtual_robot)\..*\._[a-z]\w*|_[a-z]\w*")
OF_TUPLES = {"_replace", "_asdict", "_fields"}  # public despite the underscore


def main() -> int:
    """Print where one of them uses a private name of another module."""
    found = [
        f"{path.relative_to(ROOT)}:{line}: {name} is private: reach it through what is public, or make it public"
        for folder in GUESTS
        for path in sorted(folder.rglob("*.py"))
        for line, name in private_names(ast.parse(path.read_text("utf-8")))
    ]
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


def private_names(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Lines and names of imported, read or patched names that begin with an underscore, except those that the file
    itself defines."""
    own = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute) and _is_own(node.value)}
    own |= {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            yield from ((node.lineno, alias.name) for alias in node.names if _is_private(alias.name))
        elif isinstance(node, ast.Attribute) and _is_private(node.attr) and node.attr not in own | OF_TUPLES:
            yield node.lineno, ast.unparse(node)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith(("setattr", "setitem", "patch")):
            yield from ((node.lineno, text.value) for text in node.args if _is_patched(text))


def _is_own(value: ast.expr) -> bool:
    return isinstance(value, ast.Name) and value.id in ("self", "cls")


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def _is_patched(argument: ast.expr) -> bool:
    return (
        isinstance(argument, ast.Constant)
        and isinstance(argument.value, str)
        and bool(PATCHED.fullmatch(argument.value))
    )


if __name__ == "__main__":
    sys.exit(main())
