"""A live picture of the robot in the terminal: pressures with their last seconds, valves, phases, the link."""

import math
from collections.abc import Callable

from rich.console import Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from bifa.link import Clock, Sample, Uno
from bifa.link.table import CHAMBERS
from bifa.live.rounds import Latest, Pace
from bifa.live.trace import Trace
from bifa.screen import Console

REFRESH_S = 0.1
_WIDEST, _NARROWEST, _BESIDE = 72, 8, 50  # characters of the trace, and of what stands beside it
COLORS = {"positive": "red", "vacuum": "blue", "off": "", "both": "bold white on red"}


def dial(phase_rad: float) -> str:
    """Where in its cycle an oscillator is, in tenths."""
    at = int(phase_rad / (2 * math.pi) * 10) % 10
    return "·" * at + "●" + "·" * (9 - at)


class Monitor:
    """Collects samples and draws them."""

    def __init__(self, uno: Uno) -> None:
        self._uno = uno
        self._latest = Latest()
        self._trace = Trace()

    def take(self, samples: list[Sample]) -> None:
        """The samples since the last picture; the last one is shown."""
        if not samples:
            return
        self._latest.take(samples)
        self._trace.take(samples[-1])

    def draw(self, columns: int) -> Panel:
        """The picture as it is now, so many characters wide: in fewer the last cycle is drawn more coarsely."""
        sample = self._latest.sample
        width = max(_NARROWEST, min(_WIDEST, columns - _BESIDE))
        table = Table(box=None, pad_edge=False)
        for heading in ("chamber", "psi", f"last {self._trace.seconds:.1f} s", "valves", "phase"):
            table.add_column(heading, no_wrap=True)
        for i, name in enumerate(CHAMBERS):
            if sample is None:
                break
            connected = sample.connected[i]
            table.add_row(
                name,
                f"{sample.pressure_psi[i]:+7.3f}",
                f"{self._trace.sparkline(i, width):{width}}",
                Text(connected, COLORS[connected]),
                dial(sample.phase_rad[i]),
            )
        state = f"{sample.state}  {sample.time_us / 1e6:.1f} s" if sample else "no telemetry yet"
        head = Text.assemble((f"{state}  ", "bold"), (self._latest.warning, "bold red"))
        link = Text(self._uno.counters.text(), "dim")
        return Panel(Group(head, table, link), title="bifa monitor")


def watch(uno: Uno, clock: Clock, console: Console, duration_s: float | None, begin: Callable[[Uno], None]) -> None:
    """Connect, `begin(uno)`, and draw until Ctrl-C or for `duration_s`; the last picture stays, the robot stands."""
    monitor = Monitor(uno)
    try:
        # The robot is the innermost: it stands before anything more is drawn.
        with Live(console=console, auto_refresh=False, screen=console.is_terminal) as live, uno:
            live.update("waiting for the Uno", refresh=True)
            uno.connect()
            begin(uno)
            uno.stream(True)
            _follow(uno, clock, monitor, live, math.inf if duration_s is None else clock.now() + duration_s)
    finally:
        if uno.counters.samples:
            console.print(monitor.draw(console.width))


def _follow(uno: Uno, clock: Clock, monitor: Monitor, live: Live, end_s: float) -> None:
    pace = Pace(clock)
    while clock.now() < end_s:
        until_s, samples = clock.now() + REFRESH_S, []
        while (left_s := until_s - clock.now()) > 1e-4:
            samples += uno.samples(left_s)
        monitor.take(samples)
        live.update(monitor.draw(live.console.width), refresh=True)
        pace.wait()
