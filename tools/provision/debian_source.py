"""Fetch one Debian source package with an apt configuration of our own; the user's is only read."""

import os
import re
import subprocess
from pathlib import Path

from provision.errors import ProvisionError

APT_SOURCES = Path("/etc/apt")


def fetch_source(package: str, folder: Path, apt: Path = APT_SOURCES) -> list[Path]:
    """Download the files of a Debian source package into `folder`; apt checks their signatures and hashes."""
    sources = source_entries(apt)
    if not sources:
        raise ProvisionError(f"{apt} names no Debian archive, so the source package {package} cannot be fetched")
    folder.mkdir(parents=True, exist_ok=True)
    configuration = _private_configuration(folder, sources)
    for command in (["apt-get", "update"], ["apt-get", "source", "--download-only", package]):
        _run([command[0], *configuration, *command[1:]], folder, package)
    return sorted(path for path in folder.iterdir() if path.name.startswith(package + "_"))


def source_entries(apt: Path) -> str:
    """Return the archives of this machine as deb822 or one-line entries for source packages."""
    entries = []
    for path in sorted([apt / "sources.list", *(apt / "sources.list.d").glob("*")]):
        if not path.is_file():
            continue
        if path.suffix == ".sources":
            entries += _from_deb822(path.read_text())
        elif path.suffix == ".list":
            entries += re.findall(r"^\s*deb(?=\s)(.*)$", path.read_text(), re.MULTILINE)
    return "".join(f"deb-src {entry.strip()}\n" for entry in dict.fromkeys(entries))


def _from_deb822(text: str) -> list[str]:
    entries = []
    for stanza in re.split(r"\n\s*\n", text):
        lines = "\n".join(line for line in stanza.splitlines() if not line.startswith("#"))
        fields = {
            name.lower(): " ".join(value.split())
            for name, value in re.findall(r"^(\S+):((?:.*)(?:\n[ \t].*)*)", lines, re.MULTILINE)
        }
        if "deb" not in fields.get("types", "").split() or fields.get("enabled", "yes").lower() == "no":
            continue
        signed_by = fields.get("signed-by", "")
        option = f"[signed-by={signed_by}] " if signed_by.startswith("/") else ""
        entries += [
            f"{option}{uri} {suite} {fields.get('components', '')}".strip()
            for uri in fields.get("uris", "").split()
            for suite in fields.get("suites", "").split()
        ]
    return entries


def _private_configuration(folder: Path, sources: str) -> list[str]:
    state = folder / "apt"
    for name in ("lists/partial", "cache/archives/partial"):
        (state / name).mkdir(parents=True, exist_ok=True)
    (state / "sources.list").write_text(sources)
    options = {
        "Dir::Etc::SourceList": state / "sources.list",
        "Dir::Etc::SourceParts": "-",
        "Dir::State::Lists": state / "lists",
        "Dir::Cache": state / "cache",
        "APT::Sandbox::User": "",  # the folder is the user's own: apt's unprivileged helper could not write to it
        "Acquire::Languages": "none",
        "Acquire::Retries": "2",
    }
    return [word for name, value in options.items() for word in ("-o", f"{name}={value}")]


def _run(command: list[str], folder: Path, package: str) -> None:
    environment = os.environ | {"LC_ALL": "C", "DEBIAN_FRONTEND": "noninteractive"}
    try:
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=180)
    except FileNotFoundError as error:
        raise ProvisionError(f"apt-get is not on PATH, so the source package {package} cannot be fetched") from error
    except subprocess.TimeoutExpired as error:
        raise ProvisionError(f"apt-get took over 3 minutes to fetch the source package {package}") from error
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise ProvisionError(f"apt-get could not fetch the source package {package}: {last}")
