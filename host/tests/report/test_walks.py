"""The figure of walks side by side is drawn, for measured walks with and without a prediction."""

import numpy as np

from bifa.report.walks import Walk, draw_walks


def columns(period_s, cycles=6):
    time_s = np.arange(0, cycles * period_s, 0.01)
    phase = 2 * np.pi * time_s / period_s
    record = {"time_s": time_s, "displacement_head_mm": 10 * time_s + 5 * np.sin(phase)}
    for lag, chamber in enumerate(("body", "head", "tail")):
        command = (np.sin(phase - lag) > 0).astype(float)
        record |= {f"command_{chamber}": command, f"pressure_{chamber}_psi": 20 * command - 12}
    return record


def test_the_figure_is_written_as_png_and_svg(tmp_path):
    walks = [
        Walk("baseline", 5.7, columns(5.7), columns(5.7)),
        Walk("optimised", 2.5, columns(2.5)),
    ]
    for suffix, magic in ((".png", b"\x89PNG"), (".svg", b"<?xml")):
        path = tmp_path / f"walks{suffix}"
        draw_walks(walks, path)
        assert path.read_bytes().startswith(magic)
        assert path.stat().st_size > 10_000
