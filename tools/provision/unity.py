"""ThrowTheSwitch's Unity, the C test framework, from the Debian source package that contains a copy."""

import json
import re
import shutil
import tarfile
import tempfile
from pathlib import Path

from provision.debian_source import fetch_source
from provision.errors import ProvisionError
from provision.package import Package, build_suffix, copy_all

CARRIER = "cjson"
FILES = ("unity.c", "unity.h", "unity_internals.h")
CARRIERS_CONFIGURATION = '#include "../examples/unity_config.h"\n'
OWN_CONFIGURATION = """\
#ifdef UNITY_INCLUDE_CONFIG_H
#include "unity_config.h"
#endif
"""
BUILD_SCRIPT_FILE = "configure.py"
BUILD_SCRIPT = """\
# PlatformIO writes unity_config.h, which sends the results to stdout or to the serial port.
Import("env")
env.Append(CPPDEFINES=["UNITY_INCLUDE_CONFIG_H"], CPPPATH=["$BUILD_DIR/unity_config"])
"""
SATISFIES = "2.6.1"  # what PlatformIO asks for; the true version is in the suffix


def unity(cache: Path) -> Package:
    """Return the package; its sources are fetched into `cache` unless they are there already."""
    if not all((cache / "src" / name).is_file() for name in FILES):
        _fetch(cache)
    version = f"{SATISFIES}+{build_suffix(_version(cache / 'src' / 'unity.h'), 'debian', CARRIER)}"
    manifest = {
        "name": "Unity",
        "version": version,
        "license": "MIT",
        "frameworks": "*",
        "platforms": "*",
        "build": {"extraScript": BUILD_SCRIPT_FILE},
    }

    def fill(folder: Path) -> None:
        copy_all(cache)(folder)
        (folder / BUILD_SCRIPT_FILE).write_text(BUILD_SCRIPT)
        (folder / "library.json").write_text(json.dumps(manifest, indent=2) + "\n")

    return Package("library", "throwtheswitch", "Unity", version, fill)


def _fetch(cache: Path) -> None:
    with tempfile.TemporaryDirectory(prefix="unity-") as scratch:
        downloaded = fetch_source(CARRIER, Path(scratch))
        extract([path for path in downloaded if ".orig.tar." in path.name], Path(scratch) / "src")
        shutil.rmtree(cache, ignore_errors=True)
        cache.mkdir(parents=True)
        shutil.move(Path(scratch) / "src", cache / "src")


def extract(archives: list[Path], destination: Path) -> None:
    """Copy Unity's sources and licence out of the carrier's archive, whatever folder they are in."""
    destination.mkdir(parents=True, exist_ok=True)
    wanted = re.compile(r"/unity/(?:src/(" + "|".join(map(re.escape, FILES)) + r")|docs/(license\.txt))$")
    for archive in archives:
        with tarfile.open(archive) as tar:
            for member in tar:
                match = wanted.search(member.name)
                if match and member.isfile():
                    (destination / (match[1] or match[2])).write_bytes(tar.extractfile(member).read())
    internals = destination / "unity_internals.h"
    missing = [name for name in FILES if not (destination / name).is_file()]
    if missing:
        raise ProvisionError(f"the Debian source package {CARRIER} no longer carries Unity ({', '.join(missing)})")
    internals.write_text(internals.read_text().replace(CARRIERS_CONFIGURATION, OWN_CONFIGURATION))


def _version(header: Path) -> str:
    found = dict(re.findall(r"#define UNITY_VERSION_(MAJOR|MINOR|BUILD)\s+(\d+)", header.read_text(encoding="utf-8")))
    if len(found) == 3:
        return f"{found['MAJOR']}.{found['MINOR']}.{found['BUILD']}"
    return "2.4.3"  # the last release before unity.h began to state its version
