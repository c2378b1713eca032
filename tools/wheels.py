"""Build the sdist of each of the three packages, and the wheel from it: python tools/wheels.py [FOLDER].

Builds from a copy of the files that git lists, so that nothing is left in the tree and no other file gets in. The one
exception is the firmware image, which `bifa flash` uses where there is no checkout: build it first (`make wheels`
does, or `pio run -e uno`).
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from bifa.firmware import write_image

ROOT = Path(__file__).resolve().parent.parent
IMAGE = ROOT / ".pio" / "build" / "uno" / "firmware.hex"
PACKAGES = ("host/lacuna", "host", "host/virtual_robot")
SDIST = "import sys; from setuptools.build_meta import build_sdist; print(build_sdist(sys.argv[1]))"


def main(arguments: list[str] | None = None) -> int:
    """Build the packages and print their paths."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=ROOT / "dist", help="output folder (default: dist/)")
    parser.add_argument("--no-build-isolation", action="store_true", help="build with the setuptools installed here")
    parser.add_argument("--only", choices=PACKAGES, action="append", help="build only this package; may be repeated")
    parser.add_argument("--without-image", action="store_true", help="build bifa without firmware: it cannot flash")
    given = parser.parse_args(arguments)
    if not (ROOT / ".git").exists():
        parser.error("git lists the files to pack, and this is no clone: `pip wheel ./host/lacuna ./host` needs no git")
    image = None if given.without_image else IMAGE
    if image and not image.is_file():
        parser.error(f"no {image.relative_to(ROOT)}: run `pio run -e uno`, or leave it out with --without-image")
    for path in build(given.folder, tuple(given.only or PACKAGES), image, isolated=not given.no_build_isolation):
        print(path)
    return 0


def build(folder: Path, packages: tuple[str, ...], image: Path | None, isolated: bool = True) -> list[Path]:
    """Put the sdist and wheel of each package into `folder`; return their paths."""
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="wheels-") as scratch:
        tree = copy_tree(Path(scratch))
        if image is not None:
            write_image(image, tree / "host" / "bifa" / "firmware")
        sdists = [_sdist(tree / package, folder) for package in packages]
    return [*sdists, *(_wheel(sdist, folder, isolated) for sdist in sdists)]


def copy_tree(target: Path) -> Path:
    """Copy the files that git tracks or would add to `target`; return it."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", "host"]
    names = subprocess.run(listed, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    for name in filter(None, names):
        if (ROOT / name).is_file():
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target / name)
    return target


def _sdist(source: Path, folder: Path) -> Path:
    done = subprocess.run([sys.executable, "-c", SDIST, folder], cwd=source, check=True, capture_output=True, text=True)
    return folder / done.stdout.split()[-1]


def _wheel(sdist: Path, folder: Path, isolated: bool) -> Path:
    options = ["--no-deps", "--no-cache-dir", *([] if isolated else ["--no-build-isolation"])]
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", *options, "--wheel-dir", folder, sdist]
    before = set(folder.glob("*.whl"))
    subprocess.run(command, check=True, env=os.environ | {"PIP_DISABLE_PIP_VERSION_CHECK": "1"})
    stem = sdist.name.removesuffix(".tar.gz")
    made = set(folder.glob(f"{stem}-*.whl"))
    return max(made - before or made, key=lambda path: path.stat().st_mtime)


if __name__ == "__main__":
    sys.exit(main())
