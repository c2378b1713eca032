"""The paper's characterisation experiments (section IV) and walks, on a bench through the real firmware and link."""

from collections.abc import Callable
from typing import Any

import numpy as np

from bifa.data import Trial
from bifa.errors import BifaError
from bifa.link import Uno
from bifa.link.units import set_point_psi
from bifa.link.uno import DEAD_TIME_S, PRESSURES_AFTER_S, PRESSURES_OVER_S
from bifa.measure.alignment import AlignmentError, ClockLine, camera_rate, resampled
from bifa.measure.motion import around_motion
from bifa.measure.plan import EXTENDED, PULL_MM, SNAP_PSI, PlannedTrial
from bifa.measure.recording import BEFORE_MARK_S, LEAD_S, Bench, Recording, idle, mount
from bifa.measure.undisturbed import DisturbedError, refuse_disturbed
from bifa.printable import counted
from bifa.ranges import CHAMBERS, TICK_S

CHAMBER_OF = {"large": "body", "small": "head"}
SETTLE_S = 6.0  # for a pressure to settle: over three of the slowest time constants, 1.7 s (1 / body_alpha_s_per_s)
RELIEF_S = 12.0  # for a falling pressure: the regulator releases air more slowly

# The second switch is 5 ms off the sampling grid of the first: together they are located to 5 ms instead of 10.
STEP_UP_S, STEP_DOWN_S, STEP_END_S = 0.5, 5.005, 14.0
_LEAD_S = (BEFORE_MARK_S + 0.8 * LEAD_S, 0.5 * LEAD_S)  # left out of a record of a motion, before and after
ATTEMPTS = 3  # at recording a trial without lost telemetry and with clocks that can be aligned

SAMPLE_S = 0.01

Progress = Callable[[float], None]
Recorded = tuple[dict[str, np.ndarray], dict[str, Any], int]  # columns, notes (`extra`), lost samples


def record_trial(
    bench: Bench, uno: Uno, planned: PlannedTrial, on_progress: Progress = lambda share: None, attempts: int = ATTEMPTS
) -> Trial:
    """Run one planned trial and return it as a data set holds it; the valves are off afterwards.

    `extra` notes how well the clocks were aligned (`clock_error_s`), the actual set-point of the regulator
    (`set_point_psi`) and, for a step, when the valves switched.
    Raises BifaError if telemetry is lost, or the clocks cannot be aligned, in all `attempts`.
    """
    why = ""
    for _ in range(attempts):
        try:
            columns, extra, lost = RUNS[planned.experiment](bench, uno, planned, on_progress)
        except AlignmentError as error:
            why = str(error)
            continue
        except DisturbedError as error:
            if (status := uno.status()).state != "fault":
                raise
            raise DisturbedError(f"{error} ({status.why_stopped})") from None
        if not lost:
            if planned.pressure_psi is not None:
                extra |= set_point(planned.pressure_psi)
            return planned.as_trial(columns, extra=extra)
        why = f"{lost} samples were lost on the link; check the cable, then resume the session"
    raise BifaError(f"{planned.title}{f', {attempts} attempts' if attempts > 1 else ''}: {why}")


def _static(bench: Bench, uno: Uno, planned: PlannedTrial, on_progress: Progress) -> Recorded:
    mount(bench, uno, "static_loading", actuator=planned.actuator, rate_mm_s=planned.rate_mm_s)
    trial = planned.as_trial()
    chamber = CHAMBER_OF[trial.tested]
    _pressurise(bench, uno, chamber, trial.commanded_psi)
    return _record_motion(bench, uno, on_progress, chamber, trial.commanded_psi, 2 * 54.0 / trial.commanded_mm_s)


def _pull(bench: Bench, uno: Uno, planned: PlannedTrial, on_progress: Progress) -> Recorded:
    mount(bench, uno, "anchor_pull", rate_mm_s=planned.rate_mm_s, travel_mm=PULL_MM, **planned.settings)
    trial = planned.as_trial()
    psi = trial.commanded_psi
    # The head is extended first: it anchors even without pressure, but only after snapping out.
    _pressurise(bench, uno, "head", SNAP_PSI)
    if psi != SNAP_PSI:
        _pressurise(bench, uno, "head", psi, RELIEF_S if psi < SNAP_PSI else SETTLE_S)
    columns, extra, lost = _record_motion(bench, uno, on_progress, "head", psi, PULL_MM / trial.commanded_mm_s)
    return columns, extra | EXTENDED, lost


def _record_motion(
    bench: Bench, uno: Uno, on_progress: Progress, chamber: str, pressure_psi: float, expected_s: float
) -> Recorded:
    """Record a motion of the cross-head, which takes about `expected_s`, while `chamber` is held as `_pressurise` left
    it. Raises DisturbedError unless that chamber, and no other, was held throughout."""
    instruments = bench.instruments
    with Recording(bench, uno, on_progress) as tape:
        tape.wait(LEAD_S)
        instruments.move()
        tape.wait_while(lambda: instruments.moving, expected_s)
        tape.wait(LEAD_S)
    held = "positive" if pressure_psi > 0.0 else "vacuum" if pressure_psi < 0.0 else "off"
    refuse_disturbed(tape.samples, "holding" if pressure_psi else "idle", {chamber: held})
    measured_psi = tape.pressures_psi[:, CHAMBERS.index(chamber)]
    columns = around_motion(tape.instrument_s, tape.record, tape.pressures_s, measured_psi, _LEAD_S)
    columns["time_s"] = columns["time_s"] - columns["time_s"][0]
    return columns, noted(tape.clock), tape.lost_samples


def _step(bench: Bench, uno: Uno, planned: PlannedTrial, on_progress: Progress) -> Recorded:
    mount(bench, uno, "step_response", actuator=planned.actuator)
    trial = planned.as_trial()
    chamber = CHAMBER_OF[trial.tested]
    _off(uno)
    uno.set("pressure_psi", trial.commanded_psi)
    uno.hold(chamber, "vacuum")
    idle(bench, uno, SETTLE_S, f"The {chamber} is evacuated until it rests, contracted")
    with Recording(bench, uno, on_progress) as tape:
        tape.wait(LEAD_S)
        uno.schedule([(STEP_UP_S, chamber, "positive"), (STEP_DOWN_S, chamber, "vacuum")])
        step = f"The {chamber} steps to {trial.commanded_psi:g} psi and back to vacuum"
        tape.wait(STEP_END_S + LEAD_S, doing=step)
    refuse_disturbed(tape.samples, "holding")
    i = CHAMBERS.index(chamber)
    command = tape.commands[:, i]
    up_s, error_s = _scheduled_start(tape.uno_s, command)
    begin_s = up_s - STEP_UP_S
    keep = (tape.uno_s >= begin_s) & (tape.uno_s <= begin_s + STEP_END_S) & np.isfinite(command)
    time_s = tape.pressures_s[keep]
    columns = {
        "time_s": time_s - time_s[0],
        "command": command[keep],
        "displacement_mm": resampled(time_s, tape.instrument_s, tape.record["displacement_mm"]),
        "pressure_psi": tape.pressures_psi[keep, i],
    }
    switches = [up_s - time_s[0], up_s - time_s[0] + STEP_DOWN_S - STEP_UP_S]
    known = {"switch_time_s": [float(t) for t in switches], "switch_error_s": error_s}
    return columns, noted(tape.clock) | known | camera_rate(tape.instrument_s), tape.lost_samples


def _walk(bench: Bench, uno: Uno, planned: PlannedTrial, on_progress: Progress) -> Recorded:
    """Record a walk from rest over the planned number of cycles. Raises BifaError if no gait is planned, the walk was
    interrupted, or the clocks cannot be aligned."""
    if planned.gait is None:
        raise BifaError(f"{planned.title}: a walk needs a gait")
    period_s, cycles = planned.gait.period_s, planned.cycles
    uno.halt()
    mount(bench, uno, "locomotion", **planned.settings)
    uploaded = uno.upload({**planned.gait.as_dict(), **planned.parameters})
    with Recording(bench, uno, on_progress) as tape:
        tape.wait(LEAD_S, report=False)
        uno.run()
        doing = f"The robot walks {counted(cycles, 'cycle')} of {period_s:g} s"
        tape.wait(cycles * period_s + LEAD_S, doing=doing)
    known = {
        "tick_s": TICK_S,
        "command_age_s": PRESSURES_AFTER_S,
        "gait_ahead_s": TICK_S,  # the first switches are decided by the phases after the first step
    } | set_point(uploaded["pressure_psi"])
    extra = noted(tape.clock) | camera_rate(tape.instrument_s) | known
    return _walk_columns(tape, period_s, cycles), extra, tape.lost_samples


RUNS: dict[str, Callable[[Bench, Uno, PlannedTrial, Progress], Recorded]] = {
    "static_loading": _static,
    "step_response": _step,
    "anchor_pull": _pull,
    "locomotion": _walk,
}


def noted(clock: ClockLine) -> dict[str, Any]:
    """Return what every trial notes: the quality of the clocks' alignment, and the Uno's dead time between supplies and
    the duration over which it averages pressures."""
    clocks = {"clock_error_s": round(clock.rms_s, 7), "clock_rate": clock.rate}
    return clocks | {"dead_time_s": DEAD_TIME_S, "averaged_s": PRESSURES_OVER_S}


def set_point(commanded_psi: float) -> dict[str, float]:
    """Return what a trial notes about its pressure: the regulator's actual set-point. Vacuum (below 0) is not
    regulated."""
    return {"set_point_psi": round(set_point_psi(commanded_psi), 4)} if commanded_psi >= 0.0 else {}


def _off(uno: Uno) -> None:
    for chamber in CHAMBERS:
        uno.hold(chamber, "off")


def _pressurise(bench: Bench, uno: Uno, chamber: str, pressure_psi: float, settle_s: float = SETTLE_S) -> None:
    """Bring a chamber to a positive pressure, 0 (vented) or, for any negative one, full vacuum, and let it settle."""
    _off(uno)
    doing = f"The {chamber} is vented"
    if pressure_psi > 0.0:
        uno.set("pressure_psi", pressure_psi)
        uno.hold(chamber, "positive")
        doing = f"The {chamber} is held at {pressure_psi:g} psi"
    elif pressure_psi < 0.0:
        uno.hold(chamber, "vacuum")
        doing = f"The {chamber} is evacuated"
    idle(bench, uno, settle_s, f"{doing} until the pressure has settled")


def _scheduled_start(uno_s: np.ndarray, command: np.ndarray) -> tuple[float, float]:
    """Time on the Uno's clock at which positive pressure was switched on, and its uncertainty: each of the two switches
    happened between two samples, and they are known to be STEP_DOWN_S - STEP_UP_S apart."""
    changes = np.flatnonzero(np.diff(np.nan_to_num(command, nan=0.0)) != 0.0) + 1
    if len(changes) != 2:
        raise BifaError(
            f"the Uno's commands changed {len(changes)} times instead of twice during the step: was it stopped?"
        )
    apart_s = STEP_DOWN_S - STEP_UP_S
    low = max(uno_s[changes[0] - 1], uno_s[changes[1] - 1] - apart_s)
    high = min(uno_s[changes[0]], uno_s[changes[1]] - apart_s)
    return float(0.5 * (low + high)), float(0.5 * (high - low))


def _walk_columns(tape: Recording, period_s: float, cycles: int) -> dict[str, np.ndarray]:
    """Columns of a walk: the Uno's samples while it ran. Times count from the first switching of the valves and are
    those of the pressures; displacements are interpolated to them, commands date from the strobe just before."""
    runs = np.array([sample.state == "running" for sample in tape.samples])
    # A sample taken in the very tick that starts the run has no command yet.
    running = np.flatnonzero(runs & ~np.isnan(tape.commands).any(axis=1))
    if not len(running):
        raise BifaError("the Uno sent no sample while it ran: check the link's counters with `bifa monitor`")
    refuse_disturbed(tape.samples[np.argmax(runs) :], "running")
    # The body's phase grows evenly from 0. At a strobe it is still the phase by which the tick before switched the
    # valves, so the time at which it extrapolates to 0 is that of the first switching, a whole number of ticks ago.
    first = running[0]
    begun_s = tape.uno_s[first] - TICK_S * round(tape.samples[first].phase_rad[0] / (2 * np.pi) * period_s / TICK_S)
    since_s = tape.uno_s[running] - begun_s
    if since_s[-1] < cycles * period_s - SAMPLE_S:
        raise DisturbedError(f"the robot walked {since_s[-1]:.2f} s instead of {cycles * period_s:g}: repeat")
    within = since_s <= cycles * period_s + SAMPLE_S
    time_s, rows = since_s[within] + PRESSURES_AFTER_S, running[within]
    columns = {"time_s": time_s}
    columns |= {f"command_{chamber}": tape.commands[rows, i] for i, chamber in enumerate(CHAMBERS)}
    for name in ("displacement_head_mm", "displacement_tail_mm"):
        if name in tape.record:
            columns[name] = resampled(time_s, tape.instrument_s - begun_s, tape.record[name])
    return columns | {f"pressure_{chamber}_psi": tape.pressures_psi[rows, i] for i, chamber in enumerate(CHAMBERS)}
