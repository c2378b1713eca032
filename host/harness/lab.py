"""A simulated operator of the virtual robot's lab, who does what `next.toml` asks, with a camera and a testing machine.

As a program (`python -m harness.lab LINK FOLDER [BENCH]`) it also serves the robot on a pty. With BENCH, a bench file,
its instruments export their records in the formats of the known programs in turn, and it declares each in that file.
"""

import os
import sys
import threading
import time
import tomllib
from collections.abc import Callable
from itertools import cycle
from pathlib import Path

import numpy as np

from bifa.measure.plan import BRISK, PlannedTrial
from harness.exports import CAMERAS, EXPORTS, MACHINES, preset_of
from virtual_robot.rig import VirtualRig, open_rig

STATIC = PlannedTrial("static_loading", "small", 4.0, 20.0)
STEP = PlannedTrial("step_response", "small", 8.5)
PULL = PlannedTrial("anchor_pull", None, 8.5, 40.0)
WALK = PlannedTrial("locomotion", gait=BRISK, cycles=1)
PLAN = (STATIC, STEP, PULL, WALK)  # every experiment, each as short as is allowed

_MOUNTED_BY = {  # the settings of a trial that the stand needs
    "static_loading": ("actuator", "rate_mm_s"),
    "step_response": ("actuator",),
    "anchor_pull": ("rate_mm_s",),
    "locomotion": ("inclination_deg",),
}
_LOOK_S = 0.05


class Lab:
    """Answers each request once, by the method named after its step. `spoil(asked, record)` may alter what is saved, to
    test that it is refused."""

    def __init__(
        self,
        rig: VirtualRig,
        folder: Path,
        spoil: Callable[[dict, dict], dict] = lambda asked, r: r,
        bench: Path | None = None,
    ) -> None:
        self._rig, self._folder, self._spoil, self._bench = rig, folder, spoil, bench
        self._turns = {"machine": cycle(MACHINES), "camera": cycle(CAMERAS[:6])}
        self._stand = rig.instruments
        self._done: tuple | None = None
        self.asked: list[dict] = []
        self.review: Callable[[dict], str] = lambda asked: ""

    def look(self) -> None:
        """Do what is requested, if it has not been done yet."""
        path = self._folder / "next.toml"
        try:
            stamp, asked = (path.stat().st_ino, path.stat().st_mtime_ns), tomllib.loads(path.read_text())
        except FileNotFoundError:
            return
        if stamp == self._done:
            return
        with self._rig.world.turn:
            answer = getattr(self, asked["step"])(asked)
        if answer is None:
            return  # not finished
        self._done = stamp
        self.asked.append(asked)
        aside = self._folder / ".answer"
        aside.write_text(answer)
        os.replace(aside, self._folder / "answer")

    def known(self, asked: dict) -> str:
        return ""

    def mount(self, asked: dict) -> str:
        settings = {k: v for k, v in asked["settings"].items() if k in _MOUNTED_BY[asked["experiment"]]}
        if asked["experiment"] == "anchor_pull":
            settings["travel_mm"] = 40.0
        self._stand.mount(asked["experiment"], **settings)
        self._moved = False
        return ""

    def start(self, asked: dict) -> str:
        self._stand.start()
        return ""

    def move(self, asked: dict) -> str | None:
        if not self._moved:
            self._stand.move()
            self._moved = True
        return None if self._stand.moving else ""

    def save(self, asked: dict) -> str:
        record = self._spoil(asked, self._stand.stop())
        name = Path(asked["file"]).stem
        if self._bench is not None:
            return self._export(asked, record, name)
        edges = {"sync_time_s": record.pop("sync_time_s")}
        for file, columns in ((f"{name}.sync.csv", edges), (f"{name}.csv", record)):
            rows = np.column_stack(list(columns.values()))
            np.savetxt(self._folder / file, rows, "%.6f", ",", header=",".join(columns), comments="")
        return ""

    def _export(self, asked: dict, record: dict, name: str) -> str:
        """Export as the next program does; its clock starts at its first sample, as frame numbers do."""
        role = "machine" if asked["experiment"] in ("static_loading", "anchor_pull") else "camera"
        program = next(self._turns[role])
        begin_s = record["time_s"][0]
        edges = record.pop("sync_time_s") - begin_s
        record = {**record, "time_s": record["time_s"] - begin_s}
        known = self._bench.read_text() if self._bench.exists() else ""
        declared = f'[instrument.{role}]\npreset = "{preset_of(program)}"\n'
        if preset_of(program) == "natnet":  # stamped with the computer's time
            edges = edges + 1.7e9
        self._bench.write_text(known.split("[instrument")[0] + declared)
        (self._folder / program).mkdir(exist_ok=True)
        path = self._folder / program / f"{name}{EXPORTS[program].suffix}"
        np.savetxt(path.with_suffix(".sync.csv"), edges, "%.6f", header="sync_time_s", comments="")
        path.write_bytes(EXPORTS[program].write(record))
        return ""


def main() -> None:
    """Serve until the process is terminated."""
    link, folder = Path(sys.argv[1]), Path(sys.argv[2])
    with open_rig() as rig:
        lab = Lab(rig, folder, bench=Path(sys.argv[3]) if len(sys.argv) > 3 else None)

        def work() -> None:
            while True:
                lab.look()
                time.sleep(_LOOK_S)

        threading.Thread(target=work, daemon=True).start()
        rig.serve_pty(lambda path: print("ready", flush=True), link=link)


if __name__ == "__main__":
    main()
