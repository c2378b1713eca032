"""The Uno's telemetry and an instrument's record of the same minutes, on one clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from bifa.errors import BifaError
from bifa.link import Uno
from bifa.link.transport import Clock
from bifa.link.uno import PRESSURES_AFTER_S
from bifa.measure.alignment import ClockLine, align
from bifa.measure.instruments import Instruments, are_asked, attend, until_ready
from bifa.rig import GONE, Rig

LEAD_S = 0.3  # recorded before and after, so that the clocks are known on both sides
_PIECE_S = 0.25
BEFORE_MARK_S = 0.1  # ensures that the instrument sees strobes before the pause


@dataclass(frozen=True)
class Bench:
    """The bench that a trial is recorded on: the stand with its instruments, and the clock that paces them and the
    Uno."""

    instruments: Instruments
    clock: Clock


def bench_of(rig: Rig) -> Bench:
    """Return the bench of a rig. Raises BifaError if it has no instruments."""
    if rig.instruments is None:
        raise BifaError(
            "this port has no instruments: use `--port virtual`, or record with your own and give their file "
            "with --instrument"
        )
    return Bench(rig.instruments, rig.clock)


def mount(bench: Bench, uno: Uno, experiment: str, **settings: Any) -> None:
    """Have `experiment` set up on the stand, and wait until this is done."""
    bench.instruments.mount(experiment, **settings)
    until_ready(bench.instruments, lambda: idle(bench, uno, _PIECE_S))


def idle(bench: Bench, uno: Uno, duration_s: float, doing: str = "") -> None:
    """Let time pass while keeping the Uno informed that the host is alive. `doing`: what the robot does meanwhile,
    shown to whoever operates the instruments."""
    until_s = bench.clock.now() + duration_s
    while (left_s := until_s - bench.clock.now()) > 0:
        attend(bench.instruments, doing, left_s)
        bench.clock.sleep(min(left_s, _PIECE_S))
        uno.keep_alive()


@contextmanager
def unlinked(clock: Clock, instead_s: float = 0.0) -> Iterator[None]:
    """Bear the loss of the link, and let `instead_s` pass: what has been recorded does not depend on it any more, and
    the next command reports it."""
    try:
        yield
    except GONE:
        clock.sleep(instead_s)


class Recording:
    """A context manager: the instrument and the Uno's stream run inside it; afterwards the valves are off. The Uno
    marks its strobe at the beginning, so that both sides number the samples alike.

    `samples` are the Uno's. After a normal exit there are also `commands` and `pressures_psi` (n, 3) of body, head and
    tail; `uno_s` (n,) and `pressures_s` (n,), the times of commands and of pressures on the Uno's clock; `record`, the
    instrument's channels; `instrument_s`, its times on the Uno's clock; `clock`, the alignment of the two clocks; and
    `lost_samples`. The exit raises AlignmentError if the clocks cannot be aligned.
    """

    def __init__(self, bench: Bench, uno: Uno, on_progress: Callable[[float], None] = lambda share: None) -> None:
        self._instruments, self._clock = bench.instruments, bench.clock
        self._uno, self._on_progress = uno, on_progress
        self.samples: list[Any] = []

    def __enter__(self) -> Recording:
        self._uno.taken_samples()  # discard the rest of an earlier recording
        self._uno.stream(True)
        self._instruments.start()
        until_ready(self._instruments, lambda: self.wait(_PIECE_S, report=False))
        self.samples.clear()  # taken while the instrument was being started, which is no part of the trial
        self.wait(BEFORE_MARK_S, report=False)
        self._marked = self._uno.mark_strobe()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._uno.halt()
        if kind is None and are_asked(self._instruments):
            self._instruments.save()
            until_ready(self._instruments, self._listen)
        self.record = self._instruments.stop()
        if kind is not None:
            return self._uno.stream(False)
        with unlinked(self._clock):
            self._uno.stream(False)
        self._line_up()

    def _listen(self) -> None:
        with unlinked(self._clock, _PIECE_S):
            self._uno.samples(_PIECE_S)

    def wait(self, duration_s: float, report: bool = True, doing: str = "") -> None:
        """Let `duration_s` pass and keep the Uno's samples. `report`: whether to report the elapsed share as progress;
        `doing`: as in `idle`."""
        begun_s = self._clock.now()
        while (left_s := begun_s + duration_s - self._clock.now()) > 0:
            attend(self._instruments, doing, left_s)
            self.samples += self._uno.samples(min(left_s, _PIECE_S))
            if report:
                self._on_progress(1.0 - max(left_s, 0.0) / duration_s)

    def wait_while(self, condition: Callable[[], bool], expected_s: float) -> None:
        """Wait while `condition()` holds, about `expected_s`. Raises BifaError after three times as long plus 5 s,
        unless a person operates the instruments."""
        begun_s = self._clock.now()
        while condition():
            self.samples += self._uno.samples(_PIECE_S)
            elapsed_s = self._clock.now() - begun_s
            self._on_progress(min(elapsed_s / expected_s, 1.0))
            if not are_asked(self._instruments) and elapsed_s > 3.0 * expected_s + 5.0:
                raise BifaError(f"the cross-head is still moving after {elapsed_s:.0f} s: check the stand")

    def _line_up(self) -> None:
        samples = self.samples
        if not samples:
            raise BifaError("the Uno sent no samples: check the link's counters with `bifa monitor`")
        self.uno_s = np.array([sample.time_us for sample in samples]) * 1e-6
        self.pressures_s = self.uno_s + PRESSURES_AFTER_S
        self.pressures_psi = np.array([sample.pressure_psi for sample in samples])
        self.commands = np.array([sample.command for sample in samples])
        self.lost_samples = samples[-1].sequence - samples[0].sequence + 1 - len(samples)
        sequence = np.array([sample.sequence for sample in samples])
        self.clock: ClockLine = align(self.record["sync_time_s"], self.uno_s, sequence, self._marked)
        self.instrument_s = self.clock.to_uno(self.record["time_s"])
