"""Record a walk on a rig: pressures and commands from the Uno, displacement from the motion capture."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bifa.characterisation.alignment import ClockLine, align
from bifa.errors import BifaError
from bifa.link import Uno
from bifa.robot.cpg import CHAMBERS
from bifa.robot.gait import Gait

SAMPLE_S = 0.01
LEAD_S = 0.5  # the instrument records before the walk begins and after it ends, so that every sample has its place
TRAIL_S = 0.3
PROGRESS_EVERY_S = 0.25


@dataclass(frozen=True)
class RecordedWalk:
    """One walk: columns as a locomotion trial has them, and how well the clocks were lined up."""

    columns: dict[str, np.ndarray]
    clock: ClockLine
    lost_samples: int


def record_walk(
    rig, uno: Uno, gait: Gait, cycles: int, on_progress: Callable[[float], None] = lambda share: None, **settings
) -> RecordedWalk:
    """Walk `cycles` cycles of `gait` from rest and record it.

    rig: has `instruments` with a motion capture; settings go to its `mount` (e.g. inclination_deg).
    on_progress(share) is told the share done, 0 to 1. The valves are off afterwards, whatever happens.

    Raises BifaError where the rig has no motion capture, samples are lost, or the clocks do not line up.
    """
    if rig.instruments is None:
        raise BifaError(
            "this port has no motion capture: use `--port virtual`, or record the walk with `bifa record` "
            "and add the displacement of your own instrument"
        )
    uno.halt()
    rig.instruments.mount("locomotion", **settings)
    uno.upload(gait.as_dict())
    uno.samples(0.0)  # what is left of an earlier recording
    uno.stream(True)
    duration_s = cycles * gait.period_s
    samples = []
    try:
        rig.instruments.start()
        started_s = rig.clock.now()
        samples += _samples_for(uno, rig.clock, LEAD_S)
        uno.run()
        begun_s = rig.clock.now()
        while (left_s := begun_s + duration_s + TRAIL_S - rig.clock.now()) > 0:
            samples += _samples_for(uno, rig.clock, min(left_s, PROGRESS_EVERY_S))
            on_progress(min((rig.clock.now() - begun_s) / duration_s, 1.0))
    finally:
        uno.halt()
        record = rig.instruments.stop()
        uno.stream(False)
    strobe_s = np.array([sample.time_us for sample in samples]) * 1e-6
    first_strobe_s = next(t for t in strobe_s if uno.clock_relation.to_host(t).time_s >= started_s)
    clock = align(record["sync_time_s"], strobe_s, first_strobe_s)
    return RecordedWalk(
        columns=_columns(samples, record, clock, gait.period_s, cycles),
        clock=clock,
        lost_samples=samples[-1].sequence - samples[0].sequence + 1 - len(samples),
    )


def _samples_for(uno: Uno, clock, duration_s: float) -> list:
    """Everything that arrives within `duration_s`."""
    until_s = clock.now() + duration_s
    samples = []
    while (left_s := until_s - clock.now()) > 0:
        samples += uno.samples(left_s)
    return samples


def _columns(samples: list, record: dict, clock: ClockLine, period_s: float, cycles: int) -> dict[str, np.ndarray]:
    """The Uno's samples while it ran, from the first cycle's beginning, with the displacement at their times."""
    # A sample taken in the very tick that starts the run has no command yet.
    running = [sample for sample in samples if sample.state == "running" and not np.isnan(sample.command).any()]
    if not running:
        raise BifaError("the Uno sent no sample while it ran: check the link's counters with `bifa monitor`")
    uno_s = np.array([sample.time_us for sample in running]) * 1e-6
    # The body's phase is 0 when a run begins and grows evenly: the first sample tells when that was.
    begun_s = uno_s[0] - running[0].phase_rad[0] / (2 * np.pi) * period_s
    keep = uno_s - begun_s <= cycles * period_s + SAMPLE_S
    time_s = (uno_s - begun_s)[keep]
    columns = {"time_s": time_s}
    for i, chamber in enumerate(CHAMBERS):
        columns[f"command_{chamber}"] = np.array([float(sample.command[i]) for sample in running])[keep]
    instrument_s = clock.to_uno(record["time_s"]) - begun_s
    for name in ("displacement_head_mm", "displacement_tail_mm"):
        if name in record:
            columns[name] = np.interp(time_s, instrument_s, record[name])
    for i, chamber in enumerate(CHAMBERS):
        columns[f"pressure_{chamber}_psi"] = np.array([sample.pressure_psi[i] for sample in running])[keep]
    return columns
