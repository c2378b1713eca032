"""Walks seen from the side: an animated SVG (CSS, no script), to scale, with a clock.

It does not move if the reader prefers reduced motion, and uses the reader's colour scheme, in a page or as a file.
"""

from collections.abc import Mapping
from html import escape

import numpy as np

from bifa.report.style import PALETTES

FRAMES_PER_S = 8  # the browser interpolates in between
PIPE_MM = 147.0  # inner diameter (paper, section II)
LENGTH_MM = 186.0  # from tail to head when contracted: 240 mm extended less the body's stroke
ANCHORED_MM, FREE_MM = PIPE_MM, 0.72 * PIPE_MM
_BODY_MM, _END_MM, _WALL_MM = 52.0, 24.0, 4.0
_MARGIN_MM, _LABEL_MM, _RULER_MM = 16.0, 46.0, 46.0
_NOMINAL_WIDTH_MM = 640.0  # width up to which lettering has its nominal size; in wider pictures it grows with them


def animate_walks(
    lanes: Mapping[str, Mapping[str, np.ndarray]], seconds: float, title: str, standalone: bool = False
) -> str:
    """Draw walks in pipes one above the other, as an SVG element that repeats for ever and shows the whole record in
    `seconds`.

    lanes: by label, the columns of a locomotion trial with `displacement_tail_mm`, arrays of shape (n,); all are shown
    over the time of the first. standalone: include the colours, for a file.
    """
    time_s = np.asarray(next(iter(lanes.values()))["time_s"], float)
    frames_s = np.linspace(time_s[0], time_s[-1], max(2, round(FRAMES_PER_S * seconds)))
    paths = {label: _paths(columns, frames_s) for label, columns in lanes.items()}
    origin_mm = min(path["tail"].min() for path in paths.values())
    far_mm = max(path["head"].max() for path in paths.values()) - origin_mm + LENGTH_MM
    width = far_mm + 2 * _MARGIN_MM + _END_MM
    zoom = max(1.0, width / _NOMINAL_WIDTH_MM)
    label_mm, ruler_mm = zoom * _LABEL_MM, zoom * _RULER_MM
    lane_mm = PIPE_MM + 2 * _WALL_MM + label_mm
    height = lane_mm * len(lanes) + 2 * ruler_mm
    rules, drawn = [], []
    left = _MARGIN_MM + 0.5 * _END_MM - origin_mm
    for number, (label, path) in enumerate(paths.items()):
        top = number * lane_mm
        middle = top + label_mm + _WALL_MM + PIPE_MM / 2
        tail, head = path["tail"] + left, path["head"] + left + LENGTH_MM
        # draw shapes at natural size: enlarged from one unit, they would be blurred when a browser pauses the animation
        parts = {
            "body": (0.0, LENGTH_MM, _BODY_MM, _moves(tail, middle, "X", (head - tail) / LENGTH_MM)),
            "tail": (-_END_MM / 2, _END_MM, PIPE_MM, _moves(tail, middle, "Y", path["tail_mm"] / PIPE_MM)),
            "head": (-_END_MM / 2, _END_MM, PIPE_MM, _moves(head, middle, "Y", path["head_mm"] / PIPE_MM)),
        }
        drawn.append(_lane(label, top + label_mm, width))
        for part, (left_mm, long_mm, tall_mm, steps) in parts.items():
            name = f"walk{number}-{part}"
            rules.append(_keyframes(name, steps, seconds))
            box = f'x="{left_mm:g}" width="{long_mm:g}" y="{-tall_mm / 2:g}" height="{tall_mm:g}"'
            drawn.append(f'<rect class="{name}" {box} fill="var(--{part})"/>')
    bottom = len(lanes) * lane_mm
    ruler, clock = bottom + 8 * zoom, bottom + ruler_mm + 8 * zoom
    long, lasts_s = width - 2 * _MARGIN_MM, frames_s[-1] - frames_s[0]
    drawn += [
        _scale(ruler, left + origin_mm, far_mm, far_mm, 12, "mm", zoom),
        _scale(clock, _MARGIN_MM, long, lasts_s, 10, "s", zoom),
        f'<circle class="walk-clock" r="{6 * zoom:.1f}" fill="var(--ink)"/>',
    ]
    ends = [f"translate({x:.1f}px,{clock:.0f}px)" for x in (_MARGIN_MM, width - _MARGIN_MM)]
    rules.append(_keyframes("walk-clock", ends, seconds))
    ground = '<rect width="100%" height="100%" fill="var(--paper)"/>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" viewBox="0 0 {width:.0f} {height:.0f}">'
        f"<title>{escape(title)}</title><style>{_colors() if standalone else ''}"
        f"svg text {{ font: {13 * zoom:.1f}px system-ui, sans-serif; fill: var(--ink) }} "
        f"@media (max-width: 30rem) {{ svg text {{ font-size: {24 * zoom:.1f}px }} svg .minor {{ display: none }} }}"
        f"{''.join(rules)}"
        "@media (prefers-reduced-motion: reduce) { [class^=walk] { animation-play-state: paused } }</style>"
        f"{ground if standalone else ''}{''.join(drawn)}</svg>"
    )


def _paths(columns: Mapping[str, np.ndarray], frames_s: np.ndarray) -> dict[str, np.ndarray]:
    """Displacement of both ends, and how far their supports reach across the pipe, drawn after the pressure."""
    found = {}
    for end in ("head", "tail"):
        found[end] = np.interp(frames_s, columns["time_s"], columns[f"displacement_{end}_mm"])
        pressure = np.asarray(columns[f"pressure_{end}_psi"])
        low, high = pressure.min(), pressure.max()
        now = np.interp(frames_s, columns["time_s"], pressure)
        share = (now - low) / (high - low) if high > low else np.zeros_like(now)
        found[f"{end}_mm"] = FREE_MM + (ANCHORED_MM - FREE_MM) * share
    return found


def _moves(x: np.ndarray, y: float, along: str, size: np.ndarray) -> list[str]:
    return [f"translate({a:.1f}px,{y:.0f}px) scale{along}({s:.4f})" for a, s in zip(x, size, strict=True)]


def _keyframes(name: str, steps: list[str], seconds: float) -> str:
    count = len(steps) - 1
    frames = "".join(f"{100 * i / count:.4g}%{{transform:{step}}}" for i, step in enumerate(steps))
    return f".{name}{{animation:{name} {seconds:g}s linear infinite;transform:{steps[0]}}}@keyframes {name}{{{frames}}}"


def _lane(label: str, pipe: float, width: float) -> str:
    walls = "".join(
        f'<rect x="0" y="{y:.0f}" width="{width:.0f}" height="{_WALL_MM:g}" fill="var(--quiet)"/>'
        for y in (pipe, pipe + PIPE_MM + _WALL_MM)
    )
    return f'<text x="{_MARGIN_MM:g}" y="{pipe - 12:.0f}">{escape(label)}</text>{walls}'


def _scale(y: float, start: float, long: float, reach: float, most: int, unit: str, zoom: float) -> str:
    """Draw a line from `start` with at most about `most` marks, labelled from 0 to `reach`; every other label is
    `minor`, hidden if there is little room."""
    step = next(s for s in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000) if reach / s <= most)
    drawn = [f'<path d="M{start:.0f} {y:.0f}h{long:.0f}" stroke="var(--quiet)"/>']
    for number, place in enumerate(np.arange(0, reach + 1e-6, step)):
        x, said = start + long / reach * place, f"{place:g}" if number else f"{place:g} {unit}"
        minor = ' class="minor"' if number % 2 else ""
        anchor = "start" if number == 0 else "end" if x > start + long - 20 * zoom else "middle"
        drawn.append(f'<path d="M{x:.0f} {y:.0f}v{7 * zoom:.0f}" stroke="var(--quiet)"/>')
        drawn.append(f'<text{minor} x="{x:.0f}" y="{y + 30 * zoom:.0f}" text-anchor="{anchor}">{said}</text>')
    return "".join(drawn)


def _colors() -> str:
    light, dark = (";".join(f"--{k}:{v}" for k, v in colors.items()) for colors in PALETTES.values())
    return f"svg{{{light}}}@media (prefers-color-scheme: dark){{svg{{{dark}}}}}"
