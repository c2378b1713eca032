"""Live display of the robot in the terminal: pressures over the last seconds, valves, phases, the link."""

import math
from collections import deque
from collections.abc import Callable
from itertools import pairwise

from rich.console import Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from bifa.link import Clock, Sample, Uno
from bifa.live.rounds import Latest, Pace
from bifa.ranges import CHAMBERS
from bifa.screen import Console

REFRESH_S = 0.1
# Characters: width of the trace, and of the columns beside it.
_MAX_TRACE_COLUMNS, _MIN_TRACE_COLUMNS, _OTHER_COLUMNS = 72, 8, 50
COLORS = {"positive": "red", "vacuum": "blue", "off": "", "both": "bold white on red"}

SHORTEST_S = 2.4  # least duration of the trace
_MAX_SAMPLES = 1200  # samples, one per picture: two minutes, twice the longest cycle
BLOCKS = " ▁▂▃▄▅▆▇█"
LOWEST_PSI, HIGHEST_PSI = -15.0, 15.0


def dial(phase_rad: float) -> str:
    """Draw where in its cycle an oscillator is, in tenths."""
    at = int(phase_rad / (2 * math.pi) * 10) % 10
    return "·" * at + "●" + "·" * (9 - at)


class Trace:
    """Pressures over the last cycle of the body's oscillator, or over SHORTEST_S if longer, drawn at any width."""

    def __init__(self) -> None:
        self._kept: deque[tuple[Sample, float]] = deque(maxlen=_MAX_SAMPLES)  # with the cycles completed by then

    def take(self, sample: Sample) -> None:
        """Add the newest sample. If the Uno has restarted, so that its clock began again, drop all earlier ones."""
        if self._kept and sample.time_us < self._kept[-1][0].time_us:
            self._kept.clear()
        done = self._kept[-1][1] + _cycles(self._kept[-1][0], sample) if self._kept else 0.0
        self._kept.append((sample, done))
        while self._has_surplus():
            self._kept.popleft()

    def _has_surplus(self) -> bool:
        """Whether the oldest sample is needed neither for a whole cycle nor for the shortest duration."""
        if len(self._kept) < 3:
            return False
        second, done = self._kept[1]
        newest, by_now = self._kept[-1]
        long = newest.time_us - second.time_us >= 1e6 * SHORTEST_S
        return long and (by_now - done > 0.999 or newest.state != "running")

    @property
    def seconds(self) -> float:
        """Age of the oldest sample."""
        return (self._kept[-1][0].time_us - self._kept[0][0].time_us) / 1e6 if self._kept else 0.0

    def sparkline(self, chamber: int, width: int) -> str:
        """Draw a chamber's pressure as at most `width` blocks, from LOWEST_PSI to HIGHEST_PSI."""
        values = [sample.pressure_psi[chamber] for sample, _ in self._kept]
        count = min(width, len(values))
        bounds = [round(i * len(values) / count) for i in range(count + 1)] if count else []
        usual = sum(values) / max(len(values), 1)
        # draw the value of each stretch that is farthest from the mean: a short pulse is visible at any width
        return "".join(_block(max(values[a:b], key=lambda v: abs(v - usual))) for a, b in pairwise(bounds))


def _cycles(before: Sample, after: Sample) -> float:
    """Cycles by which the body's oscillator advanced; slightly negative in a transient."""
    turned = (after.phase_rad[0] - before.phase_rad[0]) / (2 * math.pi)
    return turned - round(turned)


def _block(pressure_psi: float) -> str:
    steps = len(BLOCKS) - 1
    share = (pressure_psi - LOWEST_PSI) / (HIGHEST_PSI - LOWEST_PSI)
    return BLOCKS[min(steps, max(0, round(share * steps)))]


class Monitor:
    """Collects samples and draws them."""

    def __init__(self, uno: Uno) -> None:
        self._uno = uno
        self._latest = Latest(uno)
        self._trace = Trace()

    def take(self, samples: list[Sample]) -> None:
        """Add the samples since the last picture; the last one is shown."""
        self._latest.take(samples)
        if samples:
            self._trace.take(samples[-1])

    def draw(self, columns: int) -> Panel:
        """Draw the present state, `columns` characters wide; in fewer, the last cycle is drawn more coarsely."""
        sample = self._latest.sample
        width = max(_MIN_TRACE_COLUMNS, min(_MAX_TRACE_COLUMNS, columns - _OTHER_COLUMNS))
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
        wrong = "  ".join(filter(None, (self._latest.fault, self._latest.warning)))
        head = Text.assemble((f"{state}  ", "bold"), (wrong, "bold red"))
        link = Text(self._uno.counters.text(), "dim")
        return Panel(Group(head, table, link), title="bifa monitor")


def watch(uno: Uno, clock: Clock, console: Console, duration_s: float | None, begin: Callable[[Uno], None]) -> None:
    """Connect, call `begin(uno)`, and draw until Ctrl-C or for `duration_s`; then stop the robot, and leave the last
    picture on the screen."""
    monitor = Monitor(uno)
    try:
        # `uno` is the innermost context: the robot is stopped before anything more is drawn.
        with Live(console=console, auto_refresh=False, screen=console.is_terminal) as live, uno:
            live.update("waiting for the Uno", refresh=True)
            uno.connect()
            begin(uno)
            uno.stream(True)
            end_s, pace = math.inf if duration_s is None else clock.now() + duration_s, Pace(clock)
            while clock.now() < end_s:
                until_s, samples = clock.now() + REFRESH_S, []
                while (left_s := until_s - clock.now()) > 1e-4:
                    samples += uno.samples(left_s)
                monitor.take(samples)
                live.update(monitor.draw(console.width), refresh=True)
                pace.wait()
    finally:
        if uno.counters.samples:
            console.print(monitor.draw(console.width))
