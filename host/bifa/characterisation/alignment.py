"""Bring an instrument's record onto the Uno's clock.

The Uno's sampling strobe (D10) is wired to the instrument's sync input: the instrument stamps each
rising edge with its own clock, the Uno stamps the same edge in its telemetry. A straight line
through the pairs gives offset and drift; what is left is the alignment's error.
"""

from dataclasses import dataclass
from math import fsum

import numpy as np

from bifa.errors import BifaError

MIN_EDGES = 20
MAX_RMS_S = 2e-3


class AlignmentError(BifaError):
    """The instrument's record cannot be lined up with the Uno's clock."""


@dataclass(frozen=True)
class ClockLine:
    """uno_s = offset_s + rate * instrument_s, with the RMS of the edges about that line."""

    offset_s: float
    rate: float
    rms_s: float
    edges: int

    def to_uno(self, instrument_s: np.ndarray) -> np.ndarray:
        """Instrument times [s], shape (n,), as times of the Uno's clock [s]."""
        return self.offset_s + self.rate * np.asarray(instrument_s)


def align(sync_s: np.ndarray, strobe_s: np.ndarray, first_strobe_s: float) -> ClockLine:
    """Line up an instrument's clock with the Uno's.

    sync_s: the instrument's stamps of consecutive rising edges [s], shape (m,).
    strobe_s: the Uno's stamps of its samples [s], shape (k,), increasing; samples lost on the link leave gaps.
    first_strobe_s: about when the first edge in `sync_s` happened, on the Uno's clock [s], to within half a
        sampling period (the host knows it from when it started the instrument).

    Raises AlignmentError where too few edges pair up or the pairs do not lie on a line.
    """
    if len(sync_s) < MIN_EDGES or len(strobe_s) < MIN_EDGES:
        raise AlignmentError(
            f"only {len(sync_s)} sync edges and {len(strobe_s)} samples: at least {MIN_EDGES} of each are needed; "
            "is D10 wired to the instrument's sync input, and was it recording?"
        )
    period_s = np.median(np.diff(strobe_s))
    # Edges are consecutive, samples may be lost: number both by their place on the strobe's grid.
    edge_number = np.round((sync_s - sync_s[0]) / np.median(np.diff(sync_s))).astype(int)
    sample_number = np.round((strobe_s - first_strobe_s) / period_s).astype(int)
    _, edge_at, sample_at = np.intersect1d(edge_number, sample_number, return_indices=True)
    if len(edge_at) < MIN_EDGES:
        raise AlignmentError(
            f"only {len(edge_at)} sync edges fall on samples of the Uno: the instrument and the Uno did not record "
            "at the same time"
        )
    x, y = sync_s[edge_at], strobe_s[sample_at]
    rate, offset_s = _line(x, y)
    rms_s = float(np.sqrt(np.mean((y - offset_s - rate * x) ** 2)))
    if rms_s > MAX_RMS_S:
        raise AlignmentError(
            f"the sync edges scatter by {rms_s * 1e3:.1f} ms about the Uno's samples (at most {MAX_RMS_S * 1e3:g} ms): "
            "check the sync wiring"
        )
    return ClockLine(offset_s, rate, rms_s, len(edge_at))


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Slope and intercept of least squares. By exact sums: what a linear algebra library says may differ in the last
    digit from run to run, and the same seed is to give the same bytes."""
    x_mean, y_mean = fsum(x) / len(x), fsum(y) / len(y)
    away = x - x_mean
    slope = fsum(away * (y - y_mean)) / fsum(away * away)
    return slope, y_mean - slope * x_mean
