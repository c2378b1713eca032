"""Record a walk on a rig: pressures and commands from the Uno, displacement from the motion capture."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bifa.errors import BifaError
from bifa.link import Uno
from bifa.link.uno import DEAD_TIME_S, PRESSURES_AFTER_S
from bifa.measure.alignment import ClockLine, camera_rate, resampled
from bifa.measure.recording import LEAD_S, Recording, mount
from bifa.measure.undisturbed import DisturbedError, refuse_disturbed
from bifa.printable import counted
from bifa.rig import Rig
from bifa.robot.cpg import CHAMBERS
from bifa.robot.gait import Gait

SAMPLE_S = 0.01
TICK_S = 1e-3  # the Uno switches valves at its ticks


@dataclass(frozen=True)
class RecordedWalk:
    """One walk: columns as a locomotion trial has them, and how well the clocks were lined up."""

    columns: dict[str, np.ndarray]
    clock: ClockLine
    lost_samples: int
    camera: dict[str, float]

    @property
    def extra(self) -> dict[str, float]:
        """What a trial notes of its recording."""
        return (
            noted(self.clock)
            | self.camera
            | {
                "switch_error_s": TICK_S / 2,
                "command_age_s": PRESSURES_AFTER_S,
                "gait_ahead_s": TICK_S,  # the first switches are by the phases after the first step
            }
        )


def noted(clock: ClockLine) -> dict[str, float]:
    """What every trial notes of how its clocks were lined up, and of what the Uno does besides its commands."""
    return {"clock_error_s": round(clock.rms_s, 7), "clock_rate": clock.rate, "dead_time_s": DEAD_TIME_S}


def record_walk(
    rig: Rig,
    uno: Uno,
    gait: Gait,
    cycles: int,
    on_progress: Callable[[float], None] = lambda share: None,
    **settings: Any,
) -> RecordedWalk:
    """Walk `cycles` cycles of `gait` from rest and record it.

    rig: has `instruments` with a motion capture; settings go to its `mount` (e.g. inclination_deg).
    on_progress(share) is told the share done, 0 to 1. The valves are off afterwards, whatever happens.

    Lost samples are counted, and no error: see experiments.record_columns.
    Raises BifaError where the rig has no motion capture or the clocks do not line up.
    """
    tape = Recording(rig, uno, on_progress)
    uno.halt()
    mount(rig, uno, "locomotion", **settings)
    uno.upload(gait.as_dict())
    with tape:
        tape.wait(LEAD_S, report=False)
        uno.run()
        doing = f"The robot walks {counted(cycles, 'cycle')} of {gait.period_s:g} s"
        tape.wait(cycles * gait.period_s + LEAD_S, doing=doing)
    return RecordedWalk(
        _columns(tape, gait.period_s, cycles), tape.clock, tape.lost_samples, camera_rate(tape.instrument_s)
    )


def _columns(tape: Recording, period_s: float, cycles: int) -> dict[str, np.ndarray]:
    """The Uno's samples while it ran, at the pressures' times since the valves first switched: the displacement then,
    the commands as they were at the strobe just before."""
    begun = next((i for i, sample in enumerate(tape.samples) if sample.state == "running"), len(tape.samples))
    # A sample taken in the very tick that starts the run has no command yet.
    running = [sample for sample in tape.samples if sample.state == "running" and not np.isnan(sample.command).any()]
    if not running:
        raise BifaError("the Uno sent no sample while it ran: check the link's counters with `bifa monitor`")
    refuse_disturbed(tape.samples[begun:], "running")
    uno_s = np.array([sample.time_us for sample in running]) * 1e-6
    # The body's phase grows evenly from 0 on. At a strobe it is still what the tick before has switched the valves by:
    # when it seems to have been 0, the valves switched for the first time.
    begun_s = uno_s[0] - running[0].phase_rad[0] / (2 * np.pi) * period_s
    keep = uno_s - begun_s <= cycles * period_s + SAMPLE_S
    if uno_s[-1] - begun_s < cycles * period_s - SAMPLE_S:
        raise DisturbedError(f"the robot walked {uno_s[-1] - begun_s:.2f} s instead of {cycles * period_s:g}: repeat")
    time_s = (uno_s - begun_s)[keep] + PRESSURES_AFTER_S
    columns = {"time_s": time_s}
    for i, chamber in enumerate(CHAMBERS):
        columns[f"command_{chamber}"] = np.array([float(sample.command[i]) for sample in running])[keep]
    instrument_s = tape.instrument_s - begun_s
    for name in ("displacement_head_mm", "displacement_tail_mm"):
        if name in tape.record:
            columns[name] = resampled(time_s, instrument_s, tape.record[name])
    for i, chamber in enumerate(CHAMBERS):
        columns[f"pressure_{chamber}_psi"] = np.array([sample.pressure_psi[i] for sample in running])[keep]
    return columns
