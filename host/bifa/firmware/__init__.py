"""The firmware image in an installed package: put there by the release (tools/wheels.py), absent in a checkout, which
builds its own. It is in Intel HEX format and states its version and tables, which must match those of this host."""

import hashlib
import re
import shutil
import tomllib
from dataclasses import asdict, dataclass
from pathlib import Path

import tomli_w

from bifa.errors import BifaError
from bifa.link.table import PROTOCOL_VERSION, TABLE_HASH
from bifa.version import __version__

FOLDER = Path(__file__).parent
HEX, HEAD = "uno.hex", "uno.toml"
# The reply to `version`, as stored in flash.
_SAYS = re.compile(rb"bifa ([\d.]+), protocol (\d+), table ([0-9a-f]{8})")


class ImageError(BifaError):
    """The image is missing, damaged, or of another version."""


@dataclass(frozen=True)
class Image:
    """Identity of an image; `sha256` is the hash of its file."""

    version: str
    protocol: int
    table: str
    sha256: str


def carried_path() -> Path | None:
    """Return the path of this package's image, or None in a checkout."""
    return FOLDER / HEX if (FOLDER / HEX).is_file() else None


def carried_image(folder: Path = FOLDER) -> Path:
    """Return the path of the package's image after checking that it is undamaged and of this host's version."""
    try:
        noted = _noted(folder / HEAD)
        found = image_of(folder / HEX)
    except FileNotFoundError as error:
        raise ImageError(
            "this installation contains no firmware: install a wheel of a release, or work in a clone of the repository"
        ) from error
    if found != noted:
        raise ImageError(f"{folder / HEX} is damaged: reinstall the wheel of bifa")
    _check_version(found, folder / HEX)
    return folder / HEX


def write_image(built: Path, folder: Path = FOLDER) -> Image:
    """Copy a built image into the package if it is of this host's version."""
    image = image_of(built)
    _check_version(image, built)
    shutil.copyfile(built, folder / HEX)
    (folder / HEAD).write_text(tomli_w.dumps(asdict(image)), "utf-8")
    return image


def image_of(path: Path) -> Image:
    """Read the identity that an image states."""
    text = path.read_bytes()
    says = _SAYS.search(_decoded(text.decode("ascii", "replace"), path))
    if says is None:
        raise ImageError(f"{path} is not a bifa firmware image")
    version, protocol, table = (group.decode() for group in says.groups())
    return Image(version, int(protocol), table, hashlib.sha256(text).hexdigest())


def _noted(path: Path) -> Image:
    try:
        return Image(**tomllib.loads(path.read_text("utf-8")))
    except (ValueError, TypeError) as error:  # not text, not TOML, or other keys
        raise ImageError(f"{path} is damaged: reinstall the wheel of bifa") from error


def _check_version(image: Image, path: Path) -> None:
    ours = (__version__, PROTOCOL_VERSION, f"{TABLE_HASH:08x}")
    if (image.version, image.protocol, image.table) != ours:
        raise ImageError(
            f"{path} has version {image.version}, protocol {image.protocol}, table {image.table}; this host has "
            "version {}, protocol {}, table {}: rebuild the firmware".format(*ours)
        )


def _decoded(text: str, path: Path) -> bytes:
    """Bytes of the data records, in the file's order, which is that of their addresses."""
    found = bytearray()
    for number, line in enumerate(text.split(), 1):
        try:
            record = bytes.fromhex(line.removeprefix(":"))
        except ValueError:
            record = b""
        if not line.startswith(":") or len(record) < 5 or len(record) != record[0] + 5 or sum(record) % 256:
            raise ImageError(f"{path}, line {number}: damaged, or not in Intel HEX format")
        if record[3] == 0:
            found += record[4:-1]
    return bytes(found)
