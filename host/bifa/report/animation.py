"""Walks as they look from the side: an SVG that moves by itself (CSS, no script), to scale, with its clock.

It stands still for who asks for less motion, and is in the reader's colours, on a page and as a picture of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

import numpy as np

from bifa.report.style import DARK, LIGHT

FRAMES_PER_S = 8  # between which the browser goes on evenly
PIPE_MM = 147.0  # inner diameter (paper, section II)
LENGTH_MM = 186.0  # from tail to head when contracted: 240 mm extended less the body's stroke
ANCHORED_MM, FREE_MM = PIPE_MM, 0.72 * PIPE_MM
_BODY_MM, _END_MM, _WALL_MM = 52.0, 24.0, 4.0
_MARGIN_MM, _LABEL_MM, _RULER_MM = 16.0, 46.0, 46.0
_EVERY_MM = 50


def animate_walks(
    lanes: Mapping[str, Mapping[str, np.ndarray]], seconds: float, title: str, standalone: bool = False
) -> str:
    """Walks over one another in pipes of their own, as an SVG element that repeats for ever and shows the whole record
    in `seconds`.

    lanes: by what stands above each, the columns of a locomotion trial with `displacement_tail_mm`, arrays of shape
    (n,), all over the time of the first. standalone: with colours of its own, for a file.
    """
    time_s = np.asarray(next(iter(lanes.values()))["time_s"], float)
    frames_s = np.linspace(time_s[0], time_s[-1], max(2, round(FRAMES_PER_S * seconds)))
    paths = {label: _paths(columns, frames_s) for label, columns in lanes.items()}
    origin_mm = min(path["tail"].min() for path in paths.values())
    far_mm = max(path["head"].max() for path in paths.values()) - origin_mm + LENGTH_MM
    width = far_mm + 2 * _MARGIN_MM + _END_MM
    lane_mm = PIPE_MM + 2 * _WALL_MM + _LABEL_MM
    height = lane_mm * len(lanes) + 2 * _RULER_MM
    rules, drawn = [], []
    left = _MARGIN_MM + 0.5 * _END_MM - origin_mm
    for number, (label, path) in enumerate(paths.items()):
        top = number * lane_mm
        middle = top + _LABEL_MM + _WALL_MM + PIPE_MM / 2
        tail, head = path["tail"] + left, path["head"] + left + LENGTH_MM
        moves = {
            "body": _moves(tail, middle, "X", head - tail),
            "tail": _moves(tail, middle, "Y", path["tail_mm"]),
            "head": _moves(head, middle, "Y", path["head_mm"]),
        }
        drawn.append(_lane(label, top, width))
        for part, steps in moves.items():
            name = f"walk{number}-{part}"
            rules.append(_keyframes(name, steps, seconds))
            box = (
                f'x="0" width="1" y="{-_BODY_MM / 2:g}" height="{_BODY_MM:g}"'
                if part == "body"
                else f'x="{-_END_MM / 2:g}" width="{_END_MM:g}" y="-0.5" height="1"'
            )
            drawn.append(f'<rect class="{name}" {box} fill="var(--{part})"/>')
    bottom = len(lanes) * lane_mm
    drawn += [_ruler(bottom + 8, left + origin_mm, far_mm), _clock(bottom + _RULER_MM + 8, width, frames_s)]
    rules.append(_keyframes("walk-clock", _clock_moves(bottom + _RULER_MM + 8, width), seconds))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" viewBox="0 0 {width:.0f} {height:.0f}">'
        f"<title>{escape(title)}</title><style>{_colours() if standalone else ''}{_LOOK}{''.join(rules)}"
        "@media (prefers-reduced-motion: reduce) { [class^=walk] { animation-play-state: paused } }</style>"
        f"{_ground() if standalone else ''}{''.join(drawn)}</svg>"
    )


_LOOK = (
    "svg text { font: 13px system-ui, sans-serif; fill: var(--ink) } "
    "@media (max-width: 30rem) { svg text { font-size: 24px } svg .minor { display: none } }"
)


def _paths(columns: Mapping[str, np.ndarray], frames_s: np.ndarray) -> dict[str, np.ndarray]:
    """Way of both ends, and how far their supports reach across the pipe: that follows the chamber's pressure."""
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
    return [f"translate({a:.1f}px,{y:.0f}px) scale{along}({s:.1f})" for a, s in zip(x, size, strict=True)]


def _keyframes(name: str, steps: list[str], seconds: float) -> str:
    count = len(steps) - 1
    frames = "".join(f"{100 * i / count:.4g}%{{transform:{step}}}" for i, step in enumerate(steps))
    return f".{name}{{animation:{name} {seconds:g}s linear infinite;transform:{steps[0]}}}@keyframes {name}{{{frames}}}"


def _lane(label: str, top: float, width: float) -> str:
    pipe = top + _LABEL_MM
    walls = "".join(
        f'<rect x="0" y="{y:.0f}" width="{width:.0f}" height="{_WALL_MM:g}" fill="var(--quiet)"/>'
        for y in (pipe, pipe + PIPE_MM + _WALL_MM)
    )
    return f'<text x="{_MARGIN_MM:g}" y="{pipe - 12:.0f}">{escape(label)}</text>{walls}'


def _ruler(y: float, zero: float, far_mm: float) -> str:
    """A scale in mm along the pipe."""
    marks = []
    for place in range(0, int(far_mm) + 1, _EVERY_MM):
        x, minor = zero + place, ' class="minor"' if place % (2 * _EVERY_MM) else ""
        unit, anchor = (" mm", "start") if place == 0 else ("", "middle")
        marks.append(f'<path d="M{x:.0f} {y:.0f}v7" stroke="var(--quiet)"/>')
        marks.append(f'<text{minor} x="{x:.0f}" y="{y + 30:.0f}" text-anchor="{anchor}">{place}{unit}</text>')
    return f'<path d="M{zero:.0f} {y:.0f}h{far_mm:.0f}" stroke="var(--quiet)"/>{"".join(marks)}'


def _clock(y: float, width: float, frames_s: np.ndarray) -> str:
    """A line of the walk's time with a dot that runs along it."""
    start, end = frames_s[0], frames_s[-1]
    long = width - 2 * _MARGIN_MM
    step = next(s for s in (1, 2, 5, 10, 20, 50, 100) if (end - start) / s <= 10)
    marks = []
    for place in np.arange(0, end - start + 1e-6, step):
        x = _MARGIN_MM + long * place / (end - start)
        minor = ' class="minor"' if round(place / step) % 2 else ""
        anchor = "start" if place == 0 else "middle"
        unit = " s" if place == 0 else ""
        marks.append(f'<path d="M{x:.0f} {y:.0f}v7" stroke="var(--quiet)"/>')
        marks.append(f'<text{minor} x="{x:.0f}" y="{y + 30:.0f}" text-anchor="{anchor}">{place:g}{unit}</text>')
    line = f'<path d="M{_MARGIN_MM:g} {y:.0f}h{long:.0f}" stroke="var(--quiet)"/>'
    return f'{line}{"".join(marks)}<circle class="walk-clock" r="6" fill="var(--ink)"/>'


def _clock_moves(y: float, width: float) -> list[str]:
    return [f"translate({x:.1f}px,{y:.0f}px)" for x in (_MARGIN_MM, width - _MARGIN_MM)]


def _colours() -> str:
    light, dark = (";".join(f"--{k}:{v}" for k, v in p.colours().items()) for p in (LIGHT, DARK))
    return f"svg{{{light}}}@media (prefers-color-scheme: dark){{svg{{{dark}}}}}"


def _ground() -> str:
    return '<rect width="100%" height="100%" fill="var(--paper)"/>'
