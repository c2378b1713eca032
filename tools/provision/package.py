"""A PlatformIO package on disk: a folder, its manifest and the label `.piopm` by which PlatformIO knows it."""

import hashlib
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Package:
    """One package of a PlatformIO core directory.

    kind: "platform", "tool" or "library"; `version`: semantic, with its true origin in the build suffix;
    fill: puts the contents into the given empty folder.
    """

    kind: str
    owner: str
    name: str
    version: str
    fill: Callable[[Path], None]

    def install(self, folder: Path) -> None:
        """Write the package to `folder`, replacing what is there only once the new one is complete."""
        unfinished = folder.with_name(folder.name + ".unfinished")
        shutil.rmtree(unfinished, ignore_errors=True)
        unfinished.mkdir(parents=True)
        self.fill(unfinished)
        if self.kind == "tool":
            manifest = {"name": self.name, "version": self.version}
            (unfinished / "package.json").write_text(json.dumps(manifest, indent=2) + "\n")
        (unfinished / ".piopm").write_text(json.dumps(self.label(), indent=2) + "\n")
        (unfinished / ".contents").write_text(_digest(unfinished) + "\n")
        shutil.rmtree(folder, ignore_errors=True)
        unfinished.rename(folder)

    def label(self) -> dict:
        """The label that PlatformIO reads to decide that a package is installed."""
        spec = {"owner": self.owner, "id": None, "name": self.name, "requirements": None, "uri": None}
        return {"type": self.kind, "name": self.name, "version": self.version, "spec": spec}


def _digest(folder: Path) -> str:
    sha = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        sha.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()


def build_suffix(*words: str) -> str:
    """Return `words` as the build part of a semantic version, which allows only letters, digits, `-` and `.`."""
    return re.sub(r"[^0-9A-Za-z-]+", ".", ".".join(words)).strip(".")


def link_all(sources: dict[str, Path]) -> Callable[[Path], None]:
    """Return a `fill` that links each name (a path within the package) to its source."""

    def fill(folder: Path) -> None:
        for name, source in sources.items():
            link = folder / name
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(source)

    return fill


def copy_all(*sources: Path) -> Callable[[Path], None]:
    """Return a `fill` that copies each source: a folder's contents, or a single file."""

    def fill(folder: Path) -> None:
        for source in sources:
            if source.is_dir():
                shutil.copytree(source, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy2(source, folder)

    return fill
