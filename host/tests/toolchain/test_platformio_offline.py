"""With the stand-ins, PlatformIO's ordinary commands need no network, even after a full clean."""

import json
import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

PIO = Path(sys.executable).with_name("pio")
FIRMWARE = """
#include <Arduino.h>
#include <Adafruit_MCP4725.h>
Adafruit_MCP4725 dac;
void setup() { dac.begin(); }
void loop() { dac.setVoltage(268, false); }
"""
SUITE = """
#include <unity.h>
#include "suite.h"
static void arithmetic() { TEST_ASSERT_EQUAL_INT(%d, 1 + 1); }
static void run() { RUN_TEST(arithmetic); }
RUN_SUITE(run)
"""


@pytest.fixture
def small_project(tmp_path, project):
    """A project with this one's platformio.ini and stand-ins, a tiny firmware and a tiny suite."""
    if not (project / ".platformio" / "stand_ins.ini").is_file():
        pytest.skip("PlatformIO's registry is used on this machine, so there are no stand-ins to test")
    for folder in ("firmware", "lib", "test/test_tiny"):
        (tmp_path / folder).mkdir(parents=True)
    shutil.copy(project / "platformio.ini", tmp_path)
    shutil.copy(project / "test" / "suite.h", tmp_path / "test")
    (tmp_path / ".platformio").symlink_to(project / ".platformio")
    (tmp_path / "firmware" / "main.cpp").write_text(FIRMWARE)
    (tmp_path / "test" / "test_tiny" / "test_main.cpp").write_text(SUITE % 2)
    return tmp_path


def pio(project: Path, *words: str) -> subprocess.CompletedProcess:
    """Run PlatformIO with proxies that refuse connections, so that any use of the network fails at once."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PLATFORMIO_")}
    environment |= dict.fromkeys(("HTTP_PROXY", "HTTPS_PROXY", "http_proxy", "https_proxy"), "http://127.0.0.1:9")
    return subprocess.run([PIO, *words], cwd=project, env=environment, capture_output=True, text=True, check=False)


def test_the_image_builds_and_after_a_full_clean_the_upload_builds_it_again(small_project, program, tmp_path):
    avrdude = own_stand_ins(small_project) / "packages" / "tool-avrdude" / "bin" / "avrdude"
    avrdude.unlink()
    program(avrdude, f'echo "$@" > {tmp_path}/call')
    image = small_project / ".pio" / "build" / "uno" / "firmware.elf"
    built = pio(small_project, "run", "-e", "uno")
    assert built.returncode == 0, built.stderr
    assert image.is_file()
    assert image.with_suffix(".hex").is_file()
    assert pio(small_project, "run", "-e", "uno", "-t", "fullclean").returncode == 0
    assert not image.is_file()
    host_end, board_end = pty.openpty()
    try:
        port = os.ttyname(board_end)
        uploaded = pio(small_project, "run", "-e", "uno", "-t", "upload", "--upload-port", port)
    finally:
        os.close(host_end)
        os.close(board_end)
    assert uploaded.returncode == 0, uploaded.stderr
    assert image.is_file()
    call = (tmp_path / "call").read_text()
    assert call.startswith(f"-p atmega328p -c arduino -D -b 115200 -P {port} -U flash:w:")
    assert "firmware.hex:i" in call


@pytest.mark.parametrize("environment", ["native", "simavr"])
def test_a_suite_passes_and_can_fail(small_project, environment):
    passed = pio(small_project, "test", "-e", environment)
    assert passed.returncode == 0, passed.stdout + passed.stderr
    assert "1 test cases: 1 succeeded" in passed.stdout + passed.stderr
    (small_project / "test" / "test_tiny" / "test_main.cpp").write_text(SUITE % 3)
    failed = pio(small_project, "test", "-e", environment)
    assert failed.returncode == 1
    assert "Expected 3 Was 2" in failed.stdout + failed.stderr


def own_stand_ins(project: Path) -> Path:
    """Give the small project its own stand-ins, so that a test may damage them."""
    core = project / ".platformio"
    shared = core.resolve()
    core.unlink()
    return shutil.copytree(shared, core, symlinks=True)


def test_another_platformio_is_told_so_at_once(small_project):
    label = own_stand_ins(small_project) / "packages" / "tool-scons" / ".piopm"
    label.write_text(json.dumps(json.loads(label.read_text()) | {"version": "4.1.0"}))
    done = pio(small_project, "run", "-e", "uno")
    assert done.returncode == 1
    assert "OtherPlatformIO: the stand-ins were laid out for another PlatformIO" in done.stderr
