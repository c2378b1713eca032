"""Fixtures: tiny images for the simulated chip, compiled by the tests."""

import shutil
import subprocess
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from harness.waiting import PATIENCE_S
from virtual_robot.rig import VirtualRig
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
def board(image: Callable[[str], Path], closes) -> Callable[..., Uno]:
    """board(source, run_s): a chip with this program, after `run_s`."""

    def build(source: str, run_s: float = 0.0, **options: object) -> Uno:
        uno = closes(Uno(image(source), **options))
        uno.run_for(run_s)
        return uno

    return build


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Callable[[VirtualRig], tuple[Path, deque[dict]]]]:
    """A function that serves a rig on a pty in its own thread; it returns the port and the rig's latest status."""

    @contextmanager
    def served(rig: VirtualRig) -> Iterator[tuple[Path, deque[dict]]]:
        ready, end, status = threading.Event(), threading.Event(), deque(maxlen=1)
        link = tmp_path / "uno"
        arguments = (lambda path: ready.set(), status.append, link, end.is_set)
        server = threading.Thread(target=rig.serve_pty, args=arguments)
        server.start()
        assert ready.wait(PATIENCE_S)
        yield link, status
        end.set()
        server.join(PATIENCE_S)
        assert not server.is_alive()
        assert not link.exists()
        rig.close()

    with ExitStack() as stack:
        yield lambda rig: stack.enter_context(served(rig))
