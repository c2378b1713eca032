"""The virtual bench: speed relative to real time, accuracy, and the time to write a sealed data set."""

import tempfile
import time
from pathlib import Path

import numpy as np

from virtual_robot import sealed
from virtual_robot.gait import BASELINE, ROBUST
from virtual_robot.plant import Plant
from virtual_robot.rig import open_rig
from virtual_robot.truths import foreign

_CAMERA_NOISE_UM = 100.0


def run() -> dict[str, float]:
    return _rig() | _plant() | _sealed()


def _rig() -> dict[str, float]:
    with open_rig(keep_events=False) as rig:
        rig.clock.sleep(0.5)
        rig.transport.write(b"load baseline\nrun\n")
        rig.clock.sleep(0.5)
        asleep, cpu, virtual = rig.uno.asleep_s, time.process_time(), rig.clock.now()
        rig.clock.sleep(20.0)
        ratio = (rig.clock.now() - virtual) / (time.process_time() - cpu)
        asleep = (rig.uno.asleep_s - asleep) / 20.0
    print(f"the image walking the plant: {ratio:.0f} x real time on one core (asked: 20), {asleep:.0%} asleep")
    return {"virtual_rig_times_real_time": ratio, "virtual_rig_asleep_share": asleep}


def _walk(gait, cycles: int, step_s: float | None) -> tuple[np.ndarray, float]:
    plant = Plant()
    plant.mount("locomotion")
    if step_s is not None:
        plant.set_step(step_s)
    for switch in gait.switches(cycles * gait.period_s):
        plant.connect(*switch)
    start = time.process_time()
    rows = plant.record(np.arange(round(cycles * gait.period_s * 100) + 1) / 100)
    return rows, time.process_time() - start


def _plant() -> dict[str, float]:
    figures = {}
    for name, gait, cycles in (("baseline", BASELINE, 8), ("robust", ROBUST, 12)):
        rows, seconds = _walk(gait, cycles, None)
        time_s = rows["time_s"]
        fine, _ = _walk(gait, cycles, 2e-5)
        speed = 1e3 * (rows["head_m"][-1] - np.interp(time_s[-1] - 3 * gait.period_s, time_s, rows["head_m"]))
        speed /= 3 * gait.period_s
        error_um = 1e6 * float(np.abs(rows["head_m"] - fine["head_m"]).max())
        ratio = cycles * gait.period_s / seconds
        print(
            f"plant alone, {name} gait: {speed:.2f} mm/s, {ratio:.0f} x real time, "
            f"{error_um:.1f} um from a fifth of the step (camera noise: {_CAMERA_NOISE_UM:.0f} um)"
        )
        figures |= {
            f"virtual_plant_{name}_mm_s": float(speed),
            f"virtual_plant_{name}_times_real_time": ratio,
            f"virtual_plant_{name}_step_error_um": error_um,
        }
    return figures


def _sealed() -> dict[str, float]:
    figures = {}
    for name, generate, asked in (("own", sealed.generate, 2), ("foreign", foreign.generate, 5)):
        with tempfile.TemporaryDirectory() as folder:
            start = time.process_time()
            generate(1, Path(folder) / "day")
            seconds = time.process_time() - start
            trials = len(list((Path(folder) / "day").glob("*.csv")))
        print(f"a sealed data set of {trials} trials, {name} truth: {seconds:.1f} s on one core (asked: {asked})")
        figures[f"sealed_data_set_{name}_seconds"] = seconds
    return figures
