"""Fixtures: a machine with the tools from which the stand-ins are made."""

from collections.abc import Callable
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[3]


@pytest.fixture
def project() -> Path:
    return PROJECT


@pytest.fixture
def program() -> Callable[[Path, str], Path]:
    """A function `write(path, script)` that puts a shell script in a program's place."""

    def write(path: Path, script: str) -> Path:
        path.write_text(f"#!/bin/sh\n{script}\n", "utf-8")
        path.chmod(0o755)
        return path

    return write


@pytest.fixture
def only_path(tmp_path, monkeypatch) -> Path:
    """An empty folder, alone on PATH."""
    folder = tmp_path / "programs"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    return folder


@pytest.fixture
def programs(program, only_path) -> Path:
    """A folder, alone on PATH, with an empty program for every tool of the AVR tool chain."""
    from provision.system import AVR_TOOLS

    for name in (*(f"avr-{tool}" for tool in AVR_TOOLS), "avrdude", "simavr"):
        program(only_path / name, "")
    return only_path


@pytest.fixture
def arduino_core(tmp_path, monkeypatch) -> Path:
    """A folder laid out like Debian's arduino-core-avr."""
    from provision import system

    root = tmp_path / "arduino"
    for name in ("cores", "libraries", "variants"):
        (root / name).mkdir(parents=True)
    monkeypatch.setattr(system, "ARDUINO_CORE", root)
    return root


@pytest.fixture
def core_dir(tmp_path) -> Path:
    """A PlatformIO core directory that is empty except for Unity's sources, which would otherwise be downloaded."""
    folder = tmp_path / "project" / ".platformio"
    sources = folder / "sources" / "unity" / "src"
    sources.mkdir(parents=True)
    for name in ("unity.c", "unity.h", "unity_internals.h"):
        (sources / name).write_text("")
    return folder
