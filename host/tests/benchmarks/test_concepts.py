"""The command of docs/concepts.md draws all its pictures, each from a run that shows what the page claims."""

import re

import pytest

from benchmarks import concepts

PAGE = concepts.IMAGES.parent / "concepts.md"


@pytest.mark.slow
def test_every_picture_of_the_page_is_drawn_and_shows_its_idea(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(concepts, "IMAGES", tmp_path)
    assert concepts.main() == 0
    drawn = {file.name for file in tmp_path.iterdir() if file.read_bytes().startswith(b"\x89PNG")}
    assert drawn == set(re.findall(r"images/(concept-[\w-]+\.png)", PAGE.read_text(encoding="utf-8")))
    said = capsys.readouterr().out
    fitted, unseen = _errors(said, "with sensor gain")[:4], _errors(said, "with sensor gain")[4:]
    assert max(fitted) < 0.5 < 3.0 < min(unseen)
    assert max(_errors(said, "with quadratic drag")) < 0.25
    shares = [float(s) for s in re.findall(r"(?:delay|coulomb) (0\.\d+)", said)]
    assert len(shares) == 2
    assert abs(sum(shares) - 1.0) < 0.02
    assert "this data cannot tell it from" in said
    assert "Next: steps (power_W 16.0) would separate heater_lag, sensor_lag." in said


def _errors(said: str, label: str) -> list[float]:
    return [float(e) for e in re.search(rf"{label} ([\d., ]+) mm", said).group(1).split(", ")]
