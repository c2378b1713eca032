"""The interrupt guard, as compiled by the image's compiler."""

import re
import subprocess

import pytest

from harness.native import ROOT

pytestmark = pytest.mark.uno

SOURCE = """
#include "critical.h"

uint8_t shared;

void twice() {
  {
    const bifa::Critical guard;
    shared = 1;
  }
  shared = 2;
}
uint8_t reads() {
  const uint8_t before = shared;
  const bifa::Critical guard;
  return before + shared;
}
"""


def instructions(tmp_path, function: str) -> list[str]:
    """Instructions of `function` as compiled by `avr-g++ -Os`; loads and stores name their variable."""
    source = tmp_path / "guarded.cpp"
    source.write_text(SOURCE)
    command = [
        "avr-g++",
        "-mmcu=atmega328p",
        "-Os",
        "-std=gnu++11",
        f"-I{ROOT / 'lib/critical'}",
        "-S",
        source,
        "-o",
        "-",
    ]
    assembly = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    body = re.search(rf"^_Z\d+{function}v:\n(.*?)^\s+ret$", assembly, re.MULTILINE | re.DOTALL)[1]
    return [line.split("\t", 1)[1].replace("\t", " ") for line in body.splitlines() if line.startswith("\t")]


def test_store_in_the_guard_stays_there_and_a_value_read_before_it_is_read_anew_in_it(tmp_path):
    code = [line for line in instructions(tmp_path, "twice") if re.match(r"cli|out __SREG__|sts shared", line)]
    assert [line.split(",")[0].split()[0] for line in code] == ["cli", "sts", "out", "sts"]
    assert sum(line.startswith("lds") for line in instructions(tmp_path, "reads")) == 2
