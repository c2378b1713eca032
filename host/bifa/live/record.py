"""Recording: walks on a rig with instruments, telemetry on a bare Uno."""

import csv
import math
import os
import shlex
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from rich.progress import Progress
from rich.status import Status

from bifa.errors import BifaError
from bifa.files import is_stray
from bifa.link import RefusedError, Sample, Uno
from bifa.link.leaving import valves_at
from bifa.link.table import MARK_PAUSE
from bifa.live.rounds import Absence
from bifa.live.walk import UNSUPPLIED, raise_if_no_reader, stopped_text
from bifa.lock import locked
from bifa.measure.desk import Desk
from bifa.printable import counted
from bifa.ranges import CHAMBERS
from bifa.rig import GONE, Rig, SameBoard
from bifa.robot.gait import BASELINE, GaitFile, read_gait_file
from bifa.screen import Console, warning

MAX_RESTARTS = 3  # most restarts while the port is away; a board that keeps its power counts each in its boot number
_CHOICE = "Press Enter to walk again; q ends."
HEADER = [
    "time_s",
    "host_time_s",
    "sequence",
    "state",
    *(f"command_{name}" for name in CHAMBERS),
    *(f"pressure_{name}_psi" for name in CHAMBERS),
    *(f"phase_{name}_rad" for name in CHAMBERS),
    "strobe",
]


class RecordingError(BifaError):
    """A recording cannot be made in a folder or file."""


def record_walks(
    rig: Rig, port: str | None, out: Path, gait_file: Path | None, cycles: int, repeats: int, console: Console
) -> None:
    """Record `repeats` walks into the data set `out`; an interrupted session resumes where it stopped."""
    from bifa.gait.settling import MIN_CYCLES, Walking, measured_speed
    from bifa.measure.plan import walks
    from bifa.measure.session import Event, provenance, run_session

    gait = read_gait_file(gait_file) if gait_file else GaitFile(BASELINE)
    with Progress(console=console) as progress:
        task = progress.add_task("waiting for the Uno", total=None)

        def on_event(event: Event) -> None:
            done = event.number - 1 + event.share
            progress.update(task, description=f"walk {event.number} of {repeats}", total=repeats, completed=done)
            if event.misfit:
                progress.console.print(warning(event.misfit))
            if event.link is not None:
                progress.console.print(f"walk {event.number}: {event.link.text()}")
            if event.trial is not None and cycles >= MIN_CYCLES:
                columns = event.trial.columns
                speed = measured_speed(columns["time_s"], columns["displacement_head_mm"], gait.gait.period_s)
                more = f"; walk it with --cycles {2 * cycles}" if speed.walking is Walking.UNSETTLED else ""
                progress.console.print(f"walk {event.number}: {speed.text}{more}")

        dataset = run_session(
            rig,
            out,
            walks(gait, repeats, cycles=cycles, name="walk"),
            name="walks",
            known=dict(rig.known),
            provenance=provenance("bifa record", port, {"cycles": cycles, **gait.parameters}),
            on_event=on_event,
        )
    console.print(
        f"{out}: {counted(len(dataset.trials), 'walk')} of {counted(cycles, 'cycle')}, "
        f"firmware {dataset.provenance['firmware']}; check it with: {shlex.join(['bifa', 'check', str(out)])}",
        soft_wrap=True,
    )


def record_telemetry(
    board: SameBoard, out: Path, gait_file: Path | None, duration_s: float | None, console: Console
) -> None:
    """Record a bare Uno's telemetry into `out`/telemetry_<n>.csv, a new file each time that the port comes back."""
    parameters = read_gait_file(gait_file).parameters if gait_file else {}
    others = (path for path in out.glob("*") if not path.name.startswith("telemetry_"))
    if not all(is_stray(path.name) for path in others):
        raise RecordingError(f"{out} contains other files; choose a new folder")
    out.mkdir(parents=True, exist_ok=True)
    end_s = math.inf if duration_s is None else time.monotonic() + duration_s
    log = _TelemetryLog(board, out, parameters, end_s, console)
    try:
        with locked(out), log.absence:
            while time.monotonic() < end_s:
                with log.absence.waited_out():
                    log.record_until_gone()
    except KeyboardInterrupt as interrupt:
        console.print(f"ended; {valves_at(interrupt)}")
    if not log.has_recorded:
        console.print("nothing was recorded")
        return
    console.print(f"{out} holds the telemetry; a data set also needs the displacement from your own instrument")


class _TelemetryLog:
    """Recorder for one particular board, which walks without being asked only the first time."""

    def __init__(
        self, board: SameBoard, out: Path, parameters: dict[str, float], end_s: float, console: Console
    ) -> None:
        self._board, self._out, self._parameters, self._end_s = board, out, parameters, end_s
        self._console, self._desk = console, Desk(console.print)
        self._nonce: int | None = None  # boot number of the last start that was seen; None before the first
        self._is_told = False
        self.has_recorded = False
        self.absence = Absence(lambda: self._nonce is not None, self._tell)

    def _tell(self, error: Exception) -> None:
        """Say once, and again after every further file, that the board is gone."""
        if self._path.exists() or not self._is_told:
            ask = "; you are asked before it walks" if self._parameters else ""
            waiting = f"recording resumes when that Uno is back{ask} (Ctrl-C ends)"
            self._console.print(f"{error}\nwhat was recorded is in {self._out}; {waiting}", soft_wrap=True)
            self._is_told = True

    def record_until_gone(self) -> None:
        """Record into a new file; raises one of GONE when the link to the Uno is lost."""
        self._path = next_file(self._out)
        uno: Uno | None = None
        try:
            with self._board.open() as rig, self._console.status("waiting for the Uno") as status:
                uno = Uno(rig.transport, rig.clock)
                with uno:
                    is_back, known = self._nonce is not None, self._greet(uno)
                    if self._parameters and uno.upload(self._parameters)["pressure_psi"] == 0.0:
                        self._console.print(warning(UNSUPPLIED))
                    uno.clock_relation.estimate(0.0)  # its first use imports for longer than `host_timeout_s` may be
                    uno.stream(True)
                    marked = uno.mark_strobe()
                    with telemetry_file(self._path) as file:
                        self.has_recorded = True
                        writer = csv.writer(file)
                        writer.writerow(HEADER)
                        if self._parameters:
                            self._ask(known) if is_back else uno.run()
                        self._record(uno, writer, file, status, marked)
        finally:
            if uno is not None and self._path.exists():
                self._console.print(f"{self._path}: {uno.counters.text()}", soft_wrap=True)

    def _greet(self, uno: Uno) -> str:
        """Connect; return in words whether this is known to be the board that was recorded before."""
        nonce = uno.connect().boot_nonce
        self.absence.unconfirmed = None
        followed = self._nonce is not None and 0 <= (nonce - self._nonce) % 65536 <= MAX_RESTARTS
        self._nonce = nonce
        if self._board.serial_number or followed:
            return "The Uno is back and has restarted"
        return "An Uno is connected, but it may be a different one"

    def _ask(self, known: str) -> None:
        if sys.stdin is not None and sys.stdin.isatty():
            self._desk.ask("walk", f"{known}. Recording continues. {_CHOICE}")
            return
        self._console.print(
            f"{known}: recording without walking, since no one can be asked; to walk, run the command again"
        )

    def _record(self, uno: Uno, writer: Any, file: TextIO, status: Status, marked: int) -> None:
        is_walking = False
        try:
            while time.monotonic() < self._end_s:
                samples = uno.samples(0.5)
                writer.writerows(telemetry_row(uno, sample, marked) for sample in samples)
                file.flush()
                os.stat(file.name)  # raises if the file was removed or renamed, of which writing takes no notice
                is_walking = is_walking or any(sample.state == "running" for sample in samples)
                if is_walking and samples and samples[-1].state != "running":
                    is_walking = False
                    self._console.print(f"{stopped_text(uno.status())}; recording continues")
                if self._parameters:  # at rest, recording continues even if nobody reads the output
                    raise_if_no_reader()
                status.update(f"recording  {uno.counters.text()}")
                self._walk_if_confirmed(uno)
        finally:
            writer.writerows(telemetry_row(uno, sample, marked) for sample in uno.taken_samples())

    def _walk_if_confirmed(self, uno: Uno) -> None:
        if not self._desk.is_asking or (answer := self._desk.answer()) is None:
            return
        if answer:
            self._desk.again(answer, "press Enter to walk")
            return
        try:
            uno.clear()  # if opening the port did not restart it, it is still stopped
            uno.run()
        except RefusedError as error:
            self._desk.ask("walk", f"{error}. {_CHOICE}")


def next_file(out: Path) -> Path:
    """Return the path numbered one above the highest, whether or not numbers below are missing."""
    numbers = [path.stem.removeprefix("telemetry_") for path in out.glob("telemetry_*.csv")]
    return out / f"telemetry_{1 + max((int(n) for n in numbers if n.isdecimal()), default=0)}.csv"


@contextmanager
def telemetry_file(path: Path) -> Iterator[TextIO]:
    """Create a file; if the disk fills, truncate it after its last whole line and raise RecordingError."""
    file = None
    try:
        with path.open("x", encoding="utf-8", newline="") as file:
            yield file
    except GONE:  # an error of the port, not of the file
        raise
    except OSError as error:
        if file is None:
            raise RecordingError(
                f"{path} cannot be written ({error.strerror or error}); no samples were kept"
            ) from None
        why = f"{path} cannot be written any further ({error.strerror or error})"
        try:
            whole = path.read_bytes()
            os.truncate(path, whole.rfind(b"\n") + 1)
        except OSError:
            raise RecordingError(f"{why}, nor read: was it removed or renamed?") from None
        raise RecordingError(
            f"{why}; the {max(whole.count(10) - 1, 0)} samples so far are kept: free some space and record again"
        ) from None


def telemetry_row(uno: Uno, sample: Sample, marked: int) -> list[Any]:
    time_s = sample.time_us / 1e6
    # An empty field where a chamber is off: neither positive nor vacuum.
    commands = ["" if command != command else f"{command:g}" for command in sample.command]
    return [
        f"{time_s:.3f}",
        f"{uno.clock_relation.estimate(time_s):.6f}",
        sample.sequence,
        sample.state,
        *commands,
        *(f"{pressure:.3f}" for pressure in sample.pressure_psi),
        *(f"{phase:.4f}" for phase in sample.phase_rad),
        int(not marked - MARK_PAUSE <= sample.sequence < marked),
    ]
