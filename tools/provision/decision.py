"""Which source was chosen, registry or stand-ins, and whether what was laid out then is still valid."""

import hashlib
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import platformio
import SCons

TOOLS = Path(__file__).resolve().parent.parent
FILE = "provisioned.json"


@dataclass(frozen=True)
class Decision:
    """source: "registry" or "stand-ins"; fingerprint: hash of everything that the laid-out files depend on."""

    source: str
    fingerprint: str

    def save(self, core_dir: Path) -> None:
        """Remember the decision; written last, so that an interrupted provisioning starts again."""
        core_dir.mkdir(exist_ok=True)
        (core_dir / FILE).write_text(json.dumps(asdict(self)) + "\n")


def remembered(core_dir: Path) -> Decision | None:
    """Return the last decision if it is still valid, else None."""
    try:
        decision = Decision(**json.loads((core_dir / FILE).read_text()))
    except (OSError, ValueError, TypeError):
        return None
    return decision if decision.fingerprint == fingerprint(core_dir) else None


def fingerprint(core_dir: Path) -> str:
    """Return a hash of the sources of this folder and of the stand-ins, the versions of PlatformIO and SCons, and the
    places linked to."""
    sha = hashlib.sha256()
    for word in (platformio.__version__, SCons.__version__, SCons.__file__, sys.prefix, str(core_dir.resolve())):
        sha.update(word.encode() + b"\0")
    for path in sorted(path for folder in ("provision", "stand_ins") for path in (TOOLS / folder).rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            sha.update(path.relative_to(TOOLS).as_posix().encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()
