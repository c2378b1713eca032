"""Record a walk: pressures and commands from the Uno, displacement from the motion capture."""

from collections.abc import Callable
from typing import Any

import numpy as np

from bifa.errors import BifaError
from bifa.link import Uno
from bifa.link.uno import DEAD_TIME_S, PRESSURES_AFTER_S
from bifa.measure.alignment import ClockLine, camera_rate, resampled
from bifa.measure.plan import PlannedTrial
from bifa.measure.recording import LEAD_S, Bench, Recording, mount
from bifa.measure.undisturbed import DisturbedError, refuse_disturbed
from bifa.printable import counted
from bifa.robot.cpg import CHAMBERS

SAMPLE_S = 0.01
TICK_S = 1e-3  # the Uno switches valves at its ticks


def noted(clock: ClockLine) -> dict[str, Any]:
    """What every trial notes of how its clocks were lined up, and of what the Uno does beyond its commands."""
    return {"clock_error_s": round(clock.rms_s, 7), "clock_rate": clock.rate, "dead_time_s": DEAD_TIME_S}


def record_walk(
    bench: Bench, uno: Uno, planned: PlannedTrial, on_progress: Callable[[float], None]
) -> tuple[dict[str, np.ndarray], dict[str, Any], int]:
    """Walk from rest for as many cycles as are planned: the columns, what is noted of them, and how many samples were
    lost. The valves are off afterwards, whatever happens.

    Raises BifaError where no gait is planned, the robot did not walk through, or the clocks do not line up.
    """
    if planned.gait is None:
        raise BifaError(f"{planned.title}: a walk needs a gait")
    period_s, cycles = planned.gait.period_s, planned.cycles
    tape = Recording(bench, uno, on_progress)
    uno.halt()
    mount(bench, uno, "locomotion", **planned.settings)
    uno.upload({**planned.gait.as_dict(), **planned.parameters})
    with tape:
        tape.wait(LEAD_S, report=False)
        uno.run()
        doing = f"The robot walks {counted(cycles, 'cycle')} of {period_s:g} s"
        tape.wait(cycles * period_s + LEAD_S, doing=doing)
    known = {
        "switch_error_s": TICK_S / 2,
        "command_age_s": PRESSURES_AFTER_S,
        "gait_ahead_s": TICK_S,  # the first switches are by the phases after the first step
    }
    extra = noted(tape.clock) | camera_rate(tape.instrument_s) | known
    return _columns(tape, period_s, cycles), extra, tape.lost_samples


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
