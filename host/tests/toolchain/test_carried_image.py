"""`bifa flash` without a checkout: the image carried by the package is verified and written by avrdude alone."""

import os
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bifa import firmware
from bifa.cli import app
from bifa.firmware import ImageError, carried_image, image_of, write_image
from bifa.link.table import TABLE_HASH
from bifa.toolchain import ToolchainError, flash
from virtual_robot.rig import open_rig

BUILT = Path(__file__).parents[3] / ".pio" / "build" / "uno" / "firmware.hex"


@pytest.fixture
def package(tmp_path) -> Path:
    """A folder like that of bifa.firmware in a wheel."""
    folder = tmp_path / "site-packages" / "bifa" / "firmware"
    folder.mkdir(parents=True)
    write_image(BUILT, folder)
    return folder


@pytest.fixture
def writes(program, tmp_path, monkeypatch) -> Path:
    """A stand-in for avrdude, alone on PATH, that keeps its arguments and the file it is given to write."""
    folder = tmp_path / "programs"
    folder.mkdir()
    program(folder / "avrdude", f'echo "$@" > {folder}/arguments\n/bin/cp uno.hex {folder}/written.hex')
    monkeypatch.setenv("PATH", str(folder))
    return folder


@pytest.fixture
def no_checkout(monkeypatch, package):
    """Run the command as an installed package would."""
    monkeypatch.setattr("bifa.toolchain.find_project", lambda: None)
    monkeypatch.setattr("bifa.toolchain.choose_port", lambda port: port)
    monkeypatch.setattr(firmware, "carried_image", lambda: carried_image(package))


def test_the_image_that_is_written_runs_in_the_chip_and_answers(monkeypatch, no_checkout, writes):
    monkeypatch.setattr("bifa.rig.open_rig", lambda port: open_rig(firmware=writes / "written.hex"))
    done = CliRunner().invoke(app, ["flash", "--port", "/dev/ttyACM0"])
    assert done.exit_code == 0, done.output
    assert "answers on /dev/ttyACM0" in done.output
    assert (writes / "arguments").read_text() == (
        "-p atmega328p -c arduino -P /dev/ttyACM0 -b 115200 -D -U flash:w:uno.hex:i\n"
    )


def test_a_failing_avrdude_ends_in_a_sentence(program, no_checkout, writes):
    program(writes / "avrdude", "echo 'stk500_recv(): programmer is not responding'\nexit 1")
    done = CliRunner().invoke(app, ["flash", "--port", "/dev/ttyACM0"])
    assert isinstance(done.exception, ToolchainError)
    assert "no bootloader answers on /dev/ttyACM0" in str(done.exception)


def test_without_avrdude_the_sentence_says_how_to_get_it(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ToolchainError, match="avrdude"):
        flash.avrdude_program()


@pytest.mark.skipif(not shutil.which("avrdude"), reason="avrdude is not installed")
def test_avrdude_itself_understands_the_command(package, tmp_path):
    """avrdude accepts the command and fails only at opening the port, which does not exist."""
    with pytest.raises(ToolchainError, match=r"not-there|can't open"):
        flash.write_with_avrdude(carried_image(package), os.fspath(tmp_path / "not-there"), lambda line: None)


def test_an_image_knows_itself():
    assert image_of(BUILT).table == f"{TABLE_HASH:08x}"


def cut(end):
    return lambda data: data[:end]


def changed(at):
    return lambda data: data[:at] + (b"0" if data[at] != ord("0") else b"1") + data[at:][1:]


@pytest.mark.parametrize(
    ("file", "damage", "says"),
    [
        ("uno.toml", cut(0), r"uno\.toml is damaged"),
        ("uno.toml", cut(10), r"uno\.toml is damaged"),
        ("uno.toml", cut(-3), r"uno\.toml is damaged"),
        ("uno.toml", lambda head: head.replace(b'sha256 = "', b'sha256 = "0'), "damaged"),
        ("uno.hex", changed(0), "damaged"),
        ("uno.hex", changed(1000), "damaged"),
        ("uno.hex", changed(-3), "damaged"),
    ],
    ids=["no head", "its start", "all but its end", "another image", "at its start", "in the middle", "at its end"],
)
def test_a_damaged_image_or_one_of_which_nobody_knows_what_it_should_be_is_not_written(package, file, damage, says):
    """An image that does not match its description is refused, as after a partial unpacking on a full disk."""
    (package / file).write_bytes(damage((package / file).read_bytes()))
    with pytest.raises(ImageError, match=says):
        carried_image(package)


def test_an_image_of_other_tables_is_neither_taken_up_nor_written(package, monkeypatch, tmp_path):
    monkeypatch.setattr("bifa.firmware.TABLE_HASH", TABLE_HASH ^ 1)
    with pytest.raises(ImageError, match="rebuild the firmware"):
        carried_image(package)
    with pytest.raises(ImageError, match="rebuild the firmware"):
        write_image(BUILT, tmp_path)


def test_what_is_no_image_of_bifa_is_refused(tmp_path):
    (tmp_path / "blink.hex").write_text(":0400000001020304F2\n:00000001FF\n")
    with pytest.raises(ImageError, match="not a bifa firmware image"):
        image_of(tmp_path / "blink.hex")


def test_a_package_without_an_image_says_so(tmp_path):
    with pytest.raises(ImageError, match="contains no firmware"):
        carried_image(tmp_path)
