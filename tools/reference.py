"""Write docs/lacuna-reference.md from the docstrings of what `lacuna` exports: python tools/lacuna_reference.py"""

import inspect
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "lacuna-reference.md"
BESIDE = ("lacuna.records.read", "lacuna.system.System", "lacuna.errors.MisuseError")


def main() -> int:
    """Write the page."""
    PAGE.write_text(reference())
    return 0


def reference() -> str:
    """The page as Markdown."""
    import lacuna

    parts = ["# Reference of lacuna\n\nGenerated from the docstrings by `python tools/lacuna_reference.py`."]
    parts += [_entry(f"lacuna.{name}", getattr(lacuna, name)) for name in lacuna.__all__ if name != "__version__"]
    for path in BESIDE:
        module, name = path.rsplit(".", 1)
        parts.append(_entry(path, getattr(__import__(module, fromlist=[name]), name)))
    return "\n\n".join(parts) + "\n"


def _entry(path: str, thing: object) -> str:
    parts = [
        f"## `{path}`",
        f"```python\n{path.rsplit('.', 1)[1]}{_signature(thing)}\n```",
        inspect.getdoc(thing) or "",
    ]
    if inspect.isclass(thing):
        own = [(n, m) for n, m in vars(thing).items() if not n.startswith("_") and inspect.isfunction(m)]
        parts += [
            f"### `.{name}{_signature(member)}`\n\n{inspect.getdoc(member)}" for name, member in own if member.__doc__
        ]
    return "\n\n".join(parts)


def _signature(thing: object) -> str:
    try:
        return str(inspect.signature(thing)).replace(" -> None", "")
    except (TypeError, ValueError):
        return ""


if __name__ == "__main__":
    sys.exit(main())
