"""Hostile data sets: extreme numbers, keys of kilobytes, names that contain terminal escape sequences."""

import tracemalloc

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from bifa.cli import app
from bifa.data import DatasetError, read_dataset, write_dataset
from bifa.robot.gait import GaitError, load_gait
from harness.data_sets import make_dataset

WALK = "locomotion_1.csv"
TITLE = "\x1b]0;owned\x07"  # sets the window's title
CLIPBOARD = "\x1b]52;c;cm0gLXJm\x07"
EXTREMES = ["1e308", "-1e308", "1.79e308", "1e12", "-1e12", "1.0001e12", "5e-324", "1e-300", "-0.0", "1e5"]
HARD_TO_SEARCH = ['x = "' + '\\"' * 200_000 + '"', "'" * 200_001, '"' * 200_001, "a" * 300_000, "a." * 99_000]


def put(folder, file: str, row: int, column: int, text: str) -> None:
    rows = [line.split(",") for line in (folder / file).read_text().split("\n")]
    rows[row][column] = text
    (folder / file).write_text("\n".join(map(",".join, rows)))


def check(folder):
    return CliRunner().invoke(app, ["check", str(folder)])


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return write_dataset(tmp_path_factory.mktemp("extremes") / "bench", make_dataset())


@given(st.data())
@settings(max_examples=30)
def test_no_number_breaks_the_check(plain, data):
    path = plain / data.draw(st.sampled_from(sorted(p.name for p in plain.glob("*.csv"))))
    whole = path.read_text()
    width, height = whole.split("\n")[0].count(",") + 1, whole.count("\n")
    try:
        for _ in range(data.draw(st.integers(1, 3))):
            row, column = data.draw(st.integers(1, height - 1)), data.draw(st.integers(0, width - 1))
            put(plain, path.name, row, column, data.draw(st.sampled_from(EXTREMES)))
        try:
            read_dataset(plain)
        except DatasetError:
            return
        result = check(plain)
        assert result.exit_code == 0, result.exception
    finally:
        path.write_text(whole)


KEYS = {
    "bare": "a" + ".a" * 20_000,
    "quoted": '"a"' + ".'b'" * 10_000,
    "escaped": '"\\""' + '."\\""' * 8_000,
    "spaced": "a" + " . a" * 10_000,
}


@pytest.mark.parametrize("key", KEYS.values(), ids=KEYS)
@pytest.mark.parametrize("form", ["{} = 1\n", "[{}]\n", "x = {{ {} = 1 }}\n"])
def test_a_key_of_kilobytes_is_refused_at_little_cost(tmp_path, key, form):
    (tmp_path / "dataset.toml").write_text("format = 1\n" + form.format(key))
    (tmp_path / "gait.toml").write_text(form.format(key))
    tracemalloc.start()
    with pytest.raises(DatasetError, match=r"dataset\.toml: is not valid TOML: A key of over 100 parts \(at line 2\)"):
        read_dataset(tmp_path)
    with pytest.raises(GaitError, match="at line 1"):
        load_gait(tmp_path / "gait.toml")
    assert tracemalloc.get_traced_memory()[1] < 10e6  # without the limit, one of them took 1.6 GB and 18 s
    tracemalloc.stop()


@pytest.mark.parametrize("text", HARD_TO_SEARCH, ids=range(len(HARD_TO_SEARCH)))
def test_looking_for_such_keys_costs_little_itself(tmp_path, text):
    (tmp_path / "dataset.toml").write_text(text)
    with pytest.raises(DatasetError):  # a search restarted at every character would take hours
        read_dataset(tmp_path)


def test_a_file_nested_too_deep_is_refused(tmp_path):
    (tmp_path / "gait.toml").write_text("x = " + "[" * 5000)
    with pytest.raises(GaitError, match="Nested too deep"):
        load_gait(tmp_path / "gait.toml")


@pytest.mark.parametrize("escape", [TITLE, CLIPBOARD, "\x9b2J", "\u202e", "\r"], ids=ascii)
@pytest.mark.parametrize("place", ["key", "table", "header"])
def test_no_escape_sequence_reaches_the_terminal_through_an_error(folder, escape, place, capsys):
    description = folder / "dataset.toml"
    quoted = "".join(f"\\u{ord(c):04x}" for c in escape)
    if place == "key":
        description.write_text(description.read_text().replace("[[trial]]", f'[[trial]]\n"{quoted}" = 1', 1))
    elif place == "table":
        description.write_text(f'"{quoted}" = 1\n' + description.read_text())
    else:
        path = folder / WALK
        path.write_bytes(path.read_bytes().replace(b"command_body", escape.encode() + b"command_body", 1))
    with pytest.raises(DatasetError) as refused:
        read_dataset(folder)
    assert str(refused.value).replace("\n", " ").isprintable()


def test_no_escape_sequence_reaches_the_terminal_through_what_is_shown(folder):
    description = folder / "dataset.toml"
    known = '[known]\n"head\\u001b]0;owned\\u0007" = 1.0\n'
    description.write_text(description.read_text().replace("[known]\n", known))
    shown = check(folder)
    assert shown.exit_code == 0
    assert "owned" in shown.output
    assert shown.output.replace("\n", "").isprintable()
