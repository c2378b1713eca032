"""The page's stop reaches the port within 100 ms, whatever strangers do to keep the server busy."""

import itertools
import subprocess
import sys
import time

import pytest

from bifa.link import frames
from bifa.robot import BASELINE
from harness.pty_uno import PtyUno
from harness.waiting import until
from harness.web_monitor import WebMonitor
from harness.web_socket import WebSocket

pytestmark = pytest.mark.real_time

WITHIN_S = 0.1
FLOOD_S = 4.0

# What strangers do, each in its own program for FLOOD_S; bounded in time and number of connections.
FLOODS = {
    "requests that are never read": r'one.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 50)',
    "connections that say nothing": "pass",
    "headers without an end": r'one.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"x" * 15_000)',
    "what is no request": r'one.sendall(b"\x00" * 60_000)',
    "pages without a token": """
        one.sendall(b"GET /live HTTP/1.1\\r\\nHost: 127.0.0.1\\r\\nUpgrade: websocket\\r\\nConnection: Upgrade\\r\\n"
                    b"Sec-WebSocket-Version: 13\\r\\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\\r\\n\\r\\n")
        one.sendall((b"\\x81\\xfe\\x0f\\xa0" + bytes(4) + b"x" * 4000) * 20)
    """,
}
_FLOOD = """
import contextlib, socket, sys, time
port, until = int(sys.argv[1]), time.monotonic() + float(sys.argv[2])
held = []
print("begun", flush=True)
while time.monotonic() < until:
    with contextlib.suppress(OSError):
        one = socket.create_connection(("127.0.0.1", port), timeout=1)
        held.append(one)
        {what}
    while len(held) > 300:
        held.pop(0).close()
"""


class Flood:
    """Two programs that connect to the server as often as they can."""

    def __init__(self, port: int, what: str) -> None:
        code = _FLOOD.format(what=what.strip())
        command = [sys.executable, "-c", code, str(port), str(FLOOD_S)]
        self._programs = [subprocess.Popen(command, stdout=subprocess.PIPE) for _ in range(2)]
        for program in self._programs:
            program.stdout.readline()

    def close(self) -> None:
        for program in self._programs:
            program.kill()
            program.wait()
            program.stdout.close()


class Watched(PtyUno):
    """An Uno on a pty that notes when a stop arrived at the port."""

    stopped_s = None

    def on_heard(self, data: bytes) -> None:
        if frames.STOP_FRAME in data and self.stopped_s is None:
            self.stopped_s = time.monotonic()


@pytest.fixture
def bifa(closes):
    return closes(WebMonitor("--run", uno=Watched()))


@pytest.mark.parametrize("flood", FLOODS)
def test_a_stop_is_at_the_port_within_a_tenth_of_a_second(bifa, flood, figure):
    owner = WebSocket(bifa.port, bifa.token)
    assert bifa.until("running")
    crowd = Flood(bifa.port, FLOODS[flood])
    try:
        taken = _stops(bifa, owner)
    finally:
        crowd.close()
        owner.close()
    figure(f"stop at the port, {flood}: worst of {len(taken)} {1e3 * max(taken):.0f} ms")
    assert max(taken) < WITHIN_S
    assert (bifa.uno.board.state, bifa.uno.board.valves) == ("stopped", 0)


def test_a_stop_does_not_wait_for_what_is_predicted_of_the_sliders(bifa, figure):
    owner = WebSocket(bifa.port, bifa.token)
    assert bifa.until("running")
    drafts = itertools.count()

    def slide() -> None:
        owner.ask("draft", gait=BASELINE.as_dict() | {"period_s": 5.0 + 0.01 * next(drafts)})

    try:
        slide()
        owner.until(lambda state: "predicted" in (state["prediction"] or {}))  # by now imported, drawn and compiled
        taken = _stops(bifa, owner, slide)
    finally:
        owner.close()
    figure(f"stop at the port while gaits are predicted: worst of {len(taken)} {1e3 * max(taken):.0f} ms")
    assert max(taken) < WITHIN_S


def _stops(bifa, owner, meanwhile=lambda: None) -> list[float]:
    """Time that each of ten stops took to reach the port, in s, whether or not the robot walks."""
    taken = []
    for _ in range(10):
        owner.until(lambda state: state["robot"] in ("running", "stopped"))
        meanwhile()
        time.sleep(0.1)
        bifa.uno.stopped_s, asked_s = None, time.monotonic()
        number = owner.ask("stop")
        until(lambda: bifa.uno.stopped_s, within_s=5)
        taken.append((bifa.uno.stopped_s or asked_s + 5) - asked_s)
        assert "confirms" in owner.answer(number)["said"]
    return taken
