"""libFuzzer with address and undefined-behaviour sanitizers on frames, console lines and EEPROM images.

20 seconds per target here, five minutes in `make soak`. Needs clang++ with libFuzzer (`tools/system-packages.sh fuzz`).
"""

import os
import random
import shutil
import subprocess
from pathlib import Path

import pytest

from bifa.link import frames
from bifa.link.table import COMMANDS, CONSOLE_COMMANDS, PARAMETERS
from harness.native import ROOT, compiled

FUZZ, BOARD = Path(__file__).with_name("fuzz"), ROOT / "host/harness/board_harness.cpp"
TARGETS = ("frames", "console", "eeprom")
FLAGS = ["-std=gnu++11", "-O1", "-g", "-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=undefined"]


def build(target: str) -> Path:
    sources = [FUZZ / f"{target}_fuzz.cpp", *sorted((ROOT / "lib").glob("*/*.cpp"))]
    try:
        return compiled(f"{target}_fuzz", ["clang++", *FLAGS, f"-I{BOARD.parent}"], sources, [BOARD])
    except RuntimeError as error:
        if "libclang_rt" in str(error):
            pytest.skip("clang has no libFuzzer here: tools/system-packages.sh fuzz")
        raise


def seeds(folder: Path) -> Path:
    """An initial corpus with every command and every message."""
    folder.mkdir()
    lines = [f"{usage.split('[')[0]}\n" for _, usage, _ in CONSOLE_COMMANDS]
    lines += [f"set {p.name} 1.5\nshow {p.name}\n" for p in PARAMETERS] + ["save a\nload a\nforget a\nrun\n!clear\n"]
    contents = [line.encode() for line in lines]
    connect = frames.encode(COMMANDS["connect"], 0, (1, 1), frames.OPEN_SEED)  # the boot nonce of the board is 1
    for message in COMMANDS.values():
        rng = random.Random(message.number)
        values = tuple(rng.randbytes(12) if "s" in message.layout else 1 for _ in message.fields)
        seed = frames.session_seed(1) if message.kind == "session" else frames.OPEN_SEED
        contents.append(connect + frames.encode(message, 0, values, seed))
    for i, content in enumerate(contents):
        (folder / f"{i}").write_bytes(content)
    return folder


def fuzz(target: str, seconds: int, folder: Path, *options: str) -> str:
    if shutil.which("clang++") is None:
        pytest.skip("clang++ is not installed: tools/system-packages.sh fuzz")
    command = [
        build(target),
        seeds(folder / "corpus"),
        f"-max_total_time={seconds}",
        "-max_len=1024",
        "-timeout=20",
        *options,
    ]
    environment = {**os.environ, "UBSAN_OPTIONS": "print_stacktrace=1"}
    done = subprocess.run(
        [*command, f"-artifact_prefix={folder}/"], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr[-5000:]
    return done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
def test_twenty_seconds(target, tmp_path):
    assert "DONE" in fuzz(target, 20, tmp_path, "-seed=1")  # about the same inputs every time


@pytest.mark.soak
@pytest.mark.parametrize("target", TARGETS)
def test_five_minutes(target, tmp_path, figure):
    report = fuzz(target, 300, tmp_path)
    figure(f"fuzzing {target}: {report.strip().splitlines()[-1]}")
