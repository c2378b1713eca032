"""Write docs/lacuna-reference.md and docs/bifa-reference.md from the docstrings of what the packages export:
python tools/reference.py"""

import importlib
import inspect
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BESIDE = {
    "lacuna": ("lacuna.records.read", "lacuna.system.System", "lacuna.errors.MisuseError"),
    "bifa": ("bifa.data.Dataset", "bifa.data.Trial", "bifa.gait.Optimum", "bifa.link.Uno"),
}


def main() -> int:
    """Write the pages."""
    for package in BESIDE:
        page(package).write_text(reference(package), "utf-8")
    return 0


def page(package: str) -> Path:
    """Path of a package's page."""
    return ROOT / "docs" / f"{package}-reference.md"


def reference(package: str) -> str:
    """A package's page as Markdown."""
    exported = importlib.import_module(package)
    parts = [f"# Reference of {package}\n\nGenerated from the docstrings by `python tools/reference.py`."]
    parts += [
        _entry(f"{package}.{name}", getattr(exported, name)) for name in exported.__all__ if name != "__version__"
    ]
    for path in BESIDE[package]:
        module, name = path.rsplit(".", 1)
        parts.append(_entry(path, getattr(importlib.import_module(module), name)))
    return "\n\n".join(parts) + "\n"


def _entry(path: str, thing: object) -> str:
    name = path.rsplit(".", 1)[1]
    if not (inspect.isclass(thing) or inspect.isroutine(thing)):
        return f"## `{path}`\n\n```python\n{name} = {thing!r}\n```"
    parts = [f"## `{path}`", f"```python\n{name}{_signature(thing)}\n```", inspect.getdoc(thing) or ""]
    if inspect.isclass(thing):
        own = [(n, m) for n, m in vars(thing).items() if not n.startswith("_") and inspect.isfunction(m)]
        parts += [
            f"### `.{name}{_signature(member)}`\n\n{inspect.getdoc(member)}" for name, member in own if member.__doc__
        ]
    return "\n\n".join(parts)


def _signature(thing: object) -> str:
    try:
        found = str(inspect.signature(thing))
    except (TypeError, ValueError):
        return ""
    found = re.sub(r"(: |-> )'([^']*)'", r"\1\2", found)  # of forward references
    return re.sub(r" -> None$|\b(?:[a-z_]\w*\.)+(?=[A-Z])", "", found)  # a class's module differs between versions


if __name__ == "__main__":
    sys.exit(main())
