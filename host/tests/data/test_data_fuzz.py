"""Random damage: the reader either refuses the file and names the place, or reads exactly what the file says."""

import csv
import random

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bifa.check import check_dataset
from bifa.data import DatasetError, read_dataset
from bifa.toml import parse_toml
from harness.tampered import tampered

SOAK = pytest.mark.soak
TOKENS = [b",", b"\n", b"\r", b"\r\n", b"nan", b"inf", b"1e999", b"-", b"e", b".", b" ", b"\t", b"\0"]
TOKENS += [b"\xff", b"\xef\xbb\xbf", b'"', b"#", b"_", b"0x1", b"time_s", b"1", b"[", b"]", b"=", b"'", b"{"]
TOKENS += [b"[[trial]]\n", b"9" * 400, "½".encode(), "\u00a0".encode(), "\u2028".encode(), b"\x0b", b"\x1c"]


def damage(raw: bytes, rng: random.Random) -> bytes:
    for _ in range(rng.randint(1, 4)):
        at, end = sorted(rng.randrange(len(raw) + 1) for _ in range(2))
        kind = rng.randrange(5)
        if kind == 0:
            raw = raw[:at] + rng.choice(TOKENS) + raw[at:]
        elif kind == 1:
            raw = raw[:at] + rng.choice(TOKENS) + raw[at + rng.randint(1, 6) :]
        elif kind == 2:
            raw = raw[:at] + raw[at + rng.randint(1, 20) :]
        elif kind == 3:
            raw = raw[:at] + bytes([rng.randrange(256)]) + raw[at + 1 :]
        else:
            raw = raw[:at] + raw[at : min(end, at + 60)] * 2 + raw[at:]
    return raw


def assert_read_exactly(dataset) -> None:
    """Compare with Python's `csv` and `float`, field by field."""
    for trial in dataset.trials:
        with (dataset.path / trial.file).open(newline="", encoding="utf-8-sig") as file:
            lines = file.read().replace("\ufeff", "").replace("\r\n", "\n").split("\n")
        header, *rows = (next(csv.reader([line], skipinitialspace=True), []) for line in lines)  # no quoted line break
        while not "".join(rows[-1]).strip():  # blank lines at the end
            rows.pop()
        assert sorted(name.strip() for name in header) == sorted(trial.columns)
        assert not any("".join(row[len(header) :]) for row in rows)
        expected = np.array([[float(field) for field in row[: len(header)]] for row in rows])
        read = np.column_stack([trial.columns[name.strip()] for name in header])
        np.testing.assert_array_equal(read, expected)
        assert np.isfinite(expected).all()
        assert (np.diff(trial.time_s) > 0).all()


def attempt(folder):
    try:
        return read_dataset(folder), None
    except DatasetError as error:
        return None, error


@pytest.mark.parametrize("target", ["locomotion_1.csv", "static_loading_2.csv", "dataset.toml"])
@pytest.mark.parametrize(("seed", "rounds"), [(1, 400), *(pytest.param(100 + k, 5000, marks=SOAK) for k in range(4))])
def test_damaged_files(folder, target, seed, rounds):
    rng = random.Random(seed)
    path = folder / target
    whole = path.read_bytes()
    refused = 0
    for _ in range(rounds):
        path.write_bytes(damage(whole, rng))
        dataset, error = attempt(folder)
        if error is None:
            assert_read_exactly(dataset)
        else:
            assert error.file
            assert error.problem
            assert error.line or not error.file.endswith(".csv")
            refused += 1
    assert rounds / 4 < refused < rounds


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_data_set_of_which_a_value_is_spoilt_is_read_and_checked_or_refused(folder, data):
    whole = parse_toml((folder / "dataset.toml").read_text())
    try:
        (folder / "dataset.toml").write_text(tomli_w.dumps(data.draw(tampered(whole))))
        dataset, error = attempt(folder)
    finally:
        (folder / "dataset.toml").write_text(tomli_w.dumps(whole))
    if error is None:
        check_dataset(dataset)
    else:
        assert error.problem
