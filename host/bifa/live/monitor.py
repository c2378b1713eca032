"""A live picture of the robot in the terminal: pressures with their last seconds, valves, phases, the link."""

import math
import time
from collections import deque
from collections.abc import Iterable

from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from bifa.link import Sample, Uno, WallClock
from bifa.link.table import CHAMBERS

REFRESH_S = 0.1
TRACE = 24
HISTORY_S = TRACE * REFRESH_S
BLOCKS = " ▁▂▃▄▅▆▇█"
LOWEST_PSI, HIGHEST_PSI = -15.0, 15.0


def sparkline(values: Iterable[float], width: int) -> str:
    """The last `width` values as blocks from LOWEST_PSI to HIGHEST_PSI."""
    shown = list(values)[-width:]
    steps = len(BLOCKS) - 1
    return "".join(
        BLOCKS[min(steps, max(0, round((v - LOWEST_PSI) / (HIGHEST_PSI - LOWEST_PSI) * steps)))] for v in shown
    )


def dial(phase_rad: float, width: int = 10) -> str:
    """Where in its cycle an oscillator is."""
    at = int(phase_rad / (2 * math.pi) * width) % width
    return "·" * at + "●" + "·" * (width - 1 - at)


class Monitor:
    """Collects samples and draws them."""

    def __init__(self, uno: Uno) -> None:
        self._uno = uno
        self._latest: Sample | None = None
        self._history = [deque(maxlen=round(HISTORY_S / REFRESH_S)) for _ in CHAMBERS]

    def take(self, samples: list[Sample]) -> None:
        """New samples; the last one is shown."""
        if not samples:
            return
        self._latest = samples[-1]
        for history, pressure in zip(self._history, self._latest.pressure_psi, strict=True):
            history.append(pressure)

    def draw(self) -> Panel:
        """The picture as it is now."""
        sample, counters = self._latest, self._uno.counters
        table = Table(box=None, pad_edge=False)
        for heading in (
            "chamber",
            "psi",
            f"last {HISTORY_S:g} s",
            "valves",
            "phase",
        ):
            table.add_column(heading, no_wrap=True)
        if sample is not None:
            for i, name in enumerate(CHAMBERS):
                command = sample.command[i]
                valve = (
                    Text("positive", "red") if command == 1 else Text("vacuum", "blue") if command == 0 else Text("off")
                )
                trace = sparkline(self._history[i], TRACE)
                table.add_row(
                    name, f"{sample.pressure_psi[i]:+7.3f}", f"{trace:{TRACE}}", valve, dial(sample.phase_rad[i])
                )
        state = sample.state if sample else "no telemetry yet"
        time_text = f"{sample.time_us / 1e6:.1f} s" if sample else ""
        link = (
            f"samples {counters.samples}  lost {counters.lost}  bad frames {counters.bad}  sent again {counters.resent}"
        )
        return Panel(Group(Text(f"{state}  {time_text}", "bold"), table, Text(link, "dim")), title="bifa monitor")


def watch(uno: Uno, rig, console: Console, duration_s: float | None) -> None:
    """Draw until Ctrl-C or for `duration_s`; a virtual rig is kept to the wall clock."""
    uno.stream(True)
    monitor = Monitor(uno)
    virtual = not isinstance(rig.clock, WallClock)
    end_s = math.inf if duration_s is None else rig.clock.now() + duration_s
    with Live(monitor.draw(), console=console, refresh_per_second=1 / REFRESH_S, screen=False) as live:
        while rig.clock.now() < end_s:
            began_s = time.monotonic()
            until_s = rig.clock.now() + REFRESH_S
            while (left_s := until_s - rig.clock.now()) > 1e-4:
                monitor.take(uno.samples(left_s))
            live.update(monitor.draw())
            if virtual:
                time.sleep(max(0.0, REFRESH_S - (time.monotonic() - began_s)))
