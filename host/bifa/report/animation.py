"""The robot's motion as a small SVG that animates itself: a side view of the pipe, no script, no network."""

from collections.abc import Mapping

import numpy as np

from bifa.report.style import CHAMBER_COLOURS

FRAMES_PER_S = 20
PX_PER_MM = 2.0
PIPE_MM = 147.0  # inner diameter (paper, section II)
LENGTH_MM = 186.0  # from tail to head when contracted: 240 mm extended less the body's stroke
ANCHORED_MM, FREE_MM = PIPE_MM, 0.72 * PIPE_MM


def animate_walk(columns: Mapping[str, np.ndarray], duration_s: float, title: str) -> str:
    """The last `duration_s` of a walk as an SVG element that repeats for ever.

    columns: those of a locomotion trial with `displacement_tail_mm`, arrays of shape (n,).
    The view follows nothing: the robot moves through the pipe, and starts again.
    """
    time_s = np.asarray(columns["time_s"])
    start_s = max(time_s[0], time_s[-1] - duration_s)
    frames_s = np.arange(start_s, time_s[-1], 1 / FRAMES_PER_S)
    head_mm = np.interp(frames_s, time_s, columns["displacement_head_mm"])
    tail_mm = np.interp(frames_s, time_s, columns["displacement_tail_mm"])
    origin_mm = tail_mm.min()
    head_mm, tail_mm = head_mm - origin_mm, tail_mm - origin_mm
    width = PX_PER_MM * (LENGTH_MM + head_mm.max() + 70)
    height = PX_PER_MM * (PIPE_MM + 20)
    middle = height / 2
    tail_px = PX_PER_MM * (20 + tail_mm)
    head_px = PX_PER_MM * (20 + LENGTH_MM + head_mm)
    duration = f"{frames_s[-1] - frames_s[0]:.2f}s"

    def animated(attribute: str, values: np.ndarray) -> str:
        listed = ";".join(f"{value:.1f}" for value in values)
        return f'<animate attributeName="{attribute}" values="{listed}" dur="{duration}" repeatCount="indefinite"/>'

    def segment(name: str, x_px: np.ndarray) -> str:
        pushed = _radius_mm(columns, name, frames_s) * PX_PER_MM
        colour = CHAMBER_COLOURS[name]
        return (
            f'<rect width="26" rx="9" fill="{colour}" x="{x_px[0]:.1f}" y="0" height="10">'
            f"{animated('x', x_px - 13)}{animated('y', middle - pushed / 2)}{animated('height', pushed)}</rect>"
        )

    wall = PX_PER_MM * PIPE_MM / 2
    body_height = PX_PER_MM * 52
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" viewBox="0 0 {width:.0f} {height:.0f}" class="drawing">'
        f"<title>{title}</title>"
        f'<line x1="0" x2="{width:.0f}" y1="{middle - wall - 3:.1f}" y2="{middle - wall - 3:.1f}" '
        'stroke="currentColor" stroke-width="5"/>'
        f'<line x1="0" x2="{width:.0f}" y1="{middle + wall + 3:.1f}" y2="{middle + wall + 3:.1f}" '
        'stroke="currentColor" stroke-width="5"/>'
        f'<rect y="{middle - body_height / 2:.1f}" height="{body_height:.1f}" rx="12" '
        f'fill="{CHAMBER_COLOURS["body"]}" fill-opacity="0.8" x="0" width="10">'
        f"{animated('x', tail_px)}{animated('width', head_px - tail_px)}</rect>"
        f"{segment('tail', tail_px)}{segment('head', head_px)}</svg>"
    )


def _radius_mm(columns: Mapping[str, np.ndarray], name: str, frames_s: np.ndarray) -> np.ndarray:
    """How far a segment reaches across the pipe: it follows the chamber's pressure, as the supports do."""
    pressure = np.interp(frames_s, columns["time_s"], columns[f"pressure_{name}_psi"])
    low, high = pressure.min(), pressure.max()
    share = (pressure - low) / (high - low) if high > low else np.zeros_like(pressure)
    return FREE_MM + (ANCHORED_MM - FREE_MM) * share
