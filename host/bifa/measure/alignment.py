"""Bring an instrument's record onto the Uno's clock.

The Uno's sampling strobe (D10) is wired to the instrument's sync input: the instrument stamps each rising edge with its
own clock, the Uno stamps the same edge in its telemetry. All edges look alike; so that both sides number them the same
way, the Uno omits ten strobes on command (`mark`) and reports the number of the first sample after the pause. A
straight line through the pairs gives offset and drift; the scatter about it is the alignment's error.
"""

from dataclasses import dataclass
from math import fsum

import numpy as np

from bifa.data.lost import held
from bifa.errors import BifaError
from bifa.link.table import MARK_PAUSE

MIN_EDGES = 20
MAX_RMS_S = 2e-3
MAX_DRIFT = 0.01  # the Uno's resonator is good to 0.5 %
_MAX_GRID_ERROR = 0.4  # largest deviation of an edge from the strobe's grid, in periods
_LOOP_GAIN = 0.2  # loop gain: share of an edge's deviation carried over to the next expected edge
SLOWEST_S = 0.0205  # longest period of a camera: 50 samples a second
LONGEST_GAP_S = 0.035  # longest gap that is interpolated: two samples missing at 100 a second
_RESTART_PERIODS = 5  # a restart takes the bootloader's second; edges are not lost in such numbers


class AlignmentError(BifaError):
    """The instrument's record cannot be aligned with the Uno's clock."""


@dataclass(frozen=True)
class ClockLine:
    """uno_s = offset_s + rate * instrument_s, with the RMS deviation of the edges from that line."""

    offset_s: float
    rate: float
    rms_s: float
    edges: int

    def to_uno(self, instrument_s: np.ndarray) -> np.ndarray:
        """Convert instrument times [s], shape (n,), to times of the Uno's clock [s]."""
        return self.offset_s + self.rate * np.asarray(instrument_s)


def align(sync_s: np.ndarray, uno_s: np.ndarray, sequence: np.ndarray, marked: int) -> ClockLine:
    """Align an instrument's clock with the Uno's by a mark in the strobe.

    sync_s: the instrument's stamps of rising edges [s], shape (m,), increasing, from before the mark; some may be lost.
    uno_s, sequence: the Uno's stamps of its samples [s] and their numbers, shape (k,); some may be lost.
    marked: number of the sample whose strobe was the first after the pause (`Uno.mark_strobe`).

    Raises AlignmentError if the edges do not show exactly one complete pause, too few of them pair up with samples, or
    the pairs do not lie on a line with a plausible drift: nothing is guessed.
    """
    gaps = _gaps(sync_s)
    pauses = np.flatnonzero(np.abs(gaps - (MARK_PAUSE + 1)) < _MAX_GRID_ERROR)
    if len(pauses) > 1:
        raise AlignmentError(
            f"the sync edges show {len(pauses)} pauses of {MARK_PAUSE} strobes, so it is not clear which one belongs "
            "to this recording: restart the instrument for every recording, and repeat"
        )
    if not len(pauses):
        raise AlignmentError(
            f"the sync edges do not show the pause of {MARK_PAUSE} strobes that tells which edge is which sample (the "
            f"longest gap is {gaps.max():.1f} periods): the instrument has to record from before the Uno's mark, and "
            "must not lose an edge next to it; repeat"
        )
    return _line_up(sync_s[pauses[0] + 1 :], marked, uno_s, sequence)


def align_after_restart(sync_s: np.ndarray, uno_s: np.ndarray, sequence: np.ndarray) -> ClockLine:
    """Like `align`, with the Uno's restart as the mark: the first edge after the last long pause is sample 1."""
    pauses = np.flatnonzero(_gaps(sync_s) > _RESTART_PERIODS)
    if not len(pauses):
        raise AlignmentError(
            "the sync edges show no pause of the strobe: start the instrument first, then `bifa record`; the pause "
            "tells which edge is which sample"
        )
    return _line_up(sync_s[pauses[-1] + 1 :], 1, uno_s, sequence)


def resampled(time_s: np.ndarray, instrument_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Interpolate a camera's record at `time_s`, at most two samples beyond either end of it; shape of `time_s`.

    A snap-through lasts a few samples: a cubic spline follows it, linear interpolation would not. Longer gaps are not
    filled in. Raises AlignmentError if the record begins too late or ends too early, has a gap (rows or values missing,
    a marker held or set to zero), or has too few samples a second.
    """
    measured = np.isfinite(values)
    measured[measured] = ~held(values[measured])
    if measured.sum() < 4:
        raise AlignmentError(f"the instrument's record has {int(measured.sum())} values, too few to follow; repeat")
    instrument_s, values = instrument_s[measured], values[measured]
    away_s = 2 * np.median(np.diff(instrument_s))
    _refuse_holes(instrument_s, time_s)
    late_s, early_s = instrument_s[0] - time_s[0], time_s[-1] - instrument_s[-1]
    if max(late_s, early_s) > away_s:
        what = f"begins {late_s:.2f} s too late" if late_s > away_s else f"ends {early_s:.2f} s too early"
        raise AlignmentError(f"the instrument's record {what}: it has to cover the whole experiment; repeat")
    from scipy.interpolate import CubicSpline  # slow to import

    return CubicSpline(instrument_s, values)(np.clip(time_s, instrument_s[0], instrument_s[-1]))


def camera_rate(instrument_s: np.ndarray) -> dict[str, float]:
    """Return the camera's own rate as a note of the trial, whose samples are at the Uno's rate."""
    return {"camera_rate_hz": round(float(1.0 / np.median(np.diff(instrument_s))), 1)}


def _refuse_holes(instrument_s: np.ndarray, time_s: np.ndarray) -> None:
    period_s = float(np.median(np.diff(instrument_s)))
    if period_s > SLOWEST_S:
        raise AlignmentError(
            f"the camera recorded {1.0 / period_s:.3g} samples a second: a snap-through lasts about 50 ms, so at "
            f"least 50 are needed, better 100; set its rate and repeat"
        )
    steps = np.diff(instrument_s)
    within = (instrument_s[1:] > time_s[0]) & (instrument_s[:-1] < time_s[-1])
    wide = np.flatnonzero(within & (steps > max(LONGEST_GAP_S, 2.5 * period_s)))
    if len(wide):
        worst = wide[np.argmax(steps[wide])]
        raise AlignmentError(
            f"the instrument's record has {len(wide)} gap{'s' if len(wide) > 1 else ''}, the longest of "
            f"{steps[worst]:.2f} s at {instrument_s[worst] - time_s[0]:.2f} s of the trial (about "
            f"{round(steps[worst] / period_s) - 1} samples: rows missing, or a marker lost): gaps are "
            "not filled in; repeat"
        )


def _gaps(sync_s: np.ndarray) -> np.ndarray:
    """Intervals between edges, in periods of the strobe, shape (m - 1,)."""
    if len(sync_s) < MIN_EDGES:
        raise AlignmentError(
            f"only {len(sync_s)} sync edges: at least {MIN_EDGES} are needed; is D10 wired to the instrument's sync "
            "input, and was it recording?"
        )
    return np.diff(sync_s) / np.median(np.diff(sync_s))


def _numbers(sync_s: np.ndarray) -> np.ndarray:
    """Positions of the edges on the strobe's grid, shape (m,), the first at 0.

    They are tracked from edge to edge, as in a phase-locked loop: if all were counted from the first, an error of the
    period of one part in 10,000 would amount to half a sample after a minute.
    """
    period_s = np.median(np.diff(sync_s))
    places, due_s = np.zeros(len(sync_s), int), sync_s[0]
    for i in range(1, len(sync_s)):
        periods = (sync_s[i] - due_s) / period_s
        step = round(periods)
        if step < 1 or abs(periods - step) > _MAX_GRID_ERROR:
            raise AlignmentError(
                f"sync edge {i} is {periods:.2f} periods of the strobe after the one before: check the sync wiring "
                "(D10, ground, a threshold of about 2.5 V), then repeat"
            )
        places[i] = places[i - 1] + step
        due_s += period_s * (step + _LOOP_GAIN * (periods - step))
    return places


def _line_up(sync_s: np.ndarray, first: int, uno_s: np.ndarray, sequence: np.ndarray) -> ClockLine:
    """Fit the line through edges and samples, where the first edge belongs to sample number `first`."""
    if len(sync_s) < MIN_EDGES:
        raise AlignmentError(
            f"only {len(sync_s)} sync edges after the pause of the strobe: at least {MIN_EDGES} are needed"
        )
    _, edge_at, sample_at = np.intersect1d(first + _numbers(sync_s), sequence, return_indices=True)
    if len(edge_at) < MIN_EDGES:
        raise AlignmentError(
            f"only {len(edge_at)} sync edges fall on samples of the Uno: the instrument and the Uno did not record "
            "at the same time"
        )
    x, y = np.asarray(sync_s)[edge_at], np.asarray(uno_s)[sample_at]
    rate, offset_s = _line(x, y)
    rms_s = float(np.sqrt(np.mean((y - offset_s - rate * x) ** 2)))
    if rms_s > MAX_RMS_S:
        raise AlignmentError(
            f"the sync edges scatter by {rms_s * 1e3:.1f} ms about the Uno's samples (at most {MAX_RMS_S * 1e3:g} ms): "
            "check the sync wiring"
        )
    if abs(rate - 1.0) > MAX_DRIFT:
        raise AlignmentError(
            f"the instrument's clock and the Uno's differ by {1e2 * (rate - 1.0):+.1f} % (at most "
            f"{1e2 * MAX_DRIFT:g} %): are the instrument's times in seconds?"
        )
    return ClockLine(offset_s, rate, rms_s, len(edge_at))


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Least-squares slope and intercept. Uses exact sums: results of a linear algebra library may differ in the last
    digit from run to run, but the same seed must give the same bytes."""
    x_mean, y_mean = fsum(x) / len(x), fsum(y) / len(y)
    away = x - x_mean
    slope = fsum(away * (y - y_mean)) / fsum(away * away)
    return slope, y_mean - slope * x_mean
