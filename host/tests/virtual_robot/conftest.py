"""Tiny images for the simulated chip, compiled where the tests run."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from virtual_robot.uno import Uno

HEAD = """
#include <avr/io.h>
#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <avr/eeprom.h>
#include <util/twi.h>
#include <util/delay.h>
static void serial(void) { UCSR0A = 2; UBRR0 = 7; UCSR0B = 0x18; }
static void put(uint8_t c) { while (!(UCSR0A & 0x20)) {} UDR0 = c; }
"""


@pytest.fixture
def image(tmp_path: Path) -> Callable[[str], Path]:
    """Compile C for the ATmega328P; returns the ELF file."""
    compiler = shutil.which("avr-gcc")
    if compiler is None:
        pytest.fail("avr-gcc is missing: install gcc-avr and avr-libc")

    def build(source: str) -> Path:
        code, elf = tmp_path / "image.c", tmp_path / "image.elf"
        code.write_text(HEAD + source)
        subprocess.run(
            [compiler, "-mmcu=atmega328p", "-DF_CPU=16000000UL", "-Os", "-std=gnu99", code, "-o", elf],
            check=True,
        )
        return elf

    return build


@pytest.fixture
def board(image: Callable[[str], Path]) -> Iterator[Callable[..., Uno]]:
    made: list[Uno] = []

    def build(source: str, **options: object) -> Uno:
        made.append(Uno(image(source), **options))
        return made[-1]

    yield build
    for uno in made:
        uno.close()
