"""Alignment of instruments: error of the strobe's edges, and the lag of displacement with every effect."""

import numpy as np

from bifa.check.lag import LIMIT_S, displacement_lag
from bifa.data import Trial
from bifa.link import Uno
from bifa.measure.recording import Recording
from bifa.rig import open_rig
from virtual_robot.effects import EFFECTS, plant_parameters
from virtual_robot.sealed import plans, specimen
from virtual_robot.trials import Lab

PERIOD_S = 0.01
STARTS = 50
SIZES = (0.5, 1.0, 2.0)
LAGGING = "sensor_lag"  # shifts the lag of all trials alike, as a clock offset between instruments would


def run() -> dict[str, float]:
    """Print each figure beside its limit; return them flat."""
    worst_s = _worst_edge_s()
    print(f"strobe edges of {STARTS} recordings, 1 ms apart in their start: paired to {1e3 * worst_s:.2f} ms")
    print(f"lag of displacement in steps and walks, ms (limit {1e3 * LIMIT_S:g}), at {SIZES} of the modest size")
    shifts = {}
    for effect in (None, *EFFECTS):
        lags = [lag for size in SIZES for lag in _lags_s(effect, size)]
        shifts[effect] = max(map(abs, lags), default=0.0)
        shown = f"{1e3 * min(lags):+6.1f} to {1e3 * max(lags):+5.1f} in {len(lags)} trials" if lags else "undetermined"
        print(f"  {effect or 'none':20s} {shown}")
    return {
        "recording_edge_error_ms_worst": 1e3 * worst_s,
        "recording_edge_error_ms_allowed": 0.2,
        "recording_lag_of_effects_ms_worst": 1e3 * max(s for effect, s in shifts.items() if effect != LAGGING),
        "recording_lag_of_effects_ms_allowed": 1e3 * LIMIT_S,
    }


def _worst_edge_s() -> float:
    """Largest error of an edge on the Uno's clock, judged by the bench's true time, which no recording knows."""
    with open_rig("virtual", profile="realistic") as rig, Uno(rig.transport, rig.clock) as uno:
        rig.instruments.start()
        clock = rig.instruments.clock
        rig.clock.sleep(0.05)
        first_s = _true_s(clock, rig.instruments.stop()["sync_time_s"])[0]
        uno.connect()
        errors_s = []
        for _ in range(STARTS):
            rig.clock.sleep(0.001)
            with Recording(rig, uno) as tape:
                clock = rig.instruments.clock
                tape.wait(0.5)
            edges_s = tape.record["sync_time_s"]
            truth_s = PERIOD_S + (_true_s(clock, edges_s) - first_s) * rig.world.clock_hz / 16e6
            errors_s.append(np.abs(tape.clock.to_uno(edges_s) - truth_s).max())
    return max(errors_s)


def _true_s(clock, own_s: np.ndarray) -> np.ndarray:
    return clock.start_s + (own_s - clock.offset_s) / (1.0 + clock.drift)


def _lags_s(effect: str | None, size: float) -> list[float]:
    random = np.random.default_rng(7)
    parameters, curves = specimen(random)
    inside = {effect: EFFECTS[effect].at(size, random)} if effect else {}
    lab = Lab(parameters | plant_parameters(inside), curves)
    tested = [plan for plan in plans() if plan.experiment in ("step_response", "locomotion")]
    trials = [Trial(plan.name, columns=lab.run(plan, 0.5, random), **plan.entry()) for plan in tested]
    return [lag.late_s for trial in trials if (lag := displacement_lag(trial)) is not None]
