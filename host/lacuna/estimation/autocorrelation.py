"""How much independent information there is in samples that depend on their neighbours: the one rule for it."""

from collections.abc import Sequence

import numpy as np

_NEGLIGIBLE = 0.05  # beyond the first autocorrelation below it, only chance is summed
_OUTLIER = 5.0  # in units of the noise: one bad sample must not decide


def correlation_samples(traces: Sequence[np.ndarray]) -> float:
    """How many neighbouring samples count as one: 1 + 2 sum of the autocorrelations, pooled over `traces`, which are
    in units of their noise.

    The mean is not taken out: a trace that is offset as a whole counts as two or three pieces, as it should. Missing
    samples (NaN) are no neighbours.
    """
    traces = [known for known in (t[np.isfinite(t)] for t in traces) if known.size]
    length = min((len(t) for t in traces), default=0)
    longest = max(1, length // 4)
    total = np.zeros(longest + 1)
    for trace in traces:
        clean = np.clip(trace, -_OUTLIER, _OUTLIER)
        size = 1 << (2 * len(clean) - 1).bit_length()
        spectrum = np.abs(np.fft.rfft(clean, size)) ** 2
        total += np.fft.irfft(spectrum, size)[: longest + 1] / len(clean)
    if total[0] <= 0:
        return 1.0
    correlation = total / total[0]
    below = np.flatnonzero(correlation < _NEGLIGIBLE)
    end = below[0] if len(below) else longest
    return float(max(1.0, 1 + 2 * correlation[1:end].sum()))
