"""How the live page's server handles requests that its page would not send."""

import http.client
import socket
import time
from concurrent.futures import Future

import pytest
from wsproto.events import BytesMessage, TextMessage

from bifa.live.web import server
from bifa.live.web.gate import LARGEST_MESSAGE, MAX_STRANGERS
from bifa.live.web.server import LivePage, served
from bifa.robot import nominal
from bifa.robot.gait import BASELINE
from harness.web_socket import WebSocket


class Stopping:
    """A pilot that only counts its stops."""

    def __init__(self) -> None:
        self.stops = []

    def stop(self, by: str) -> Future:
        self.stops.append(by)
        done: Future = Future()
        done.set_result(None)
        return done


@pytest.fixture
def live():
    return LivePage(Stopping(), "<!doctype html>" + "x" * 12_000_000, nominal())


@pytest.fixture
def port(live):
    with served(live) as address:
        yield address.port


@pytest.fixture
def page(live, port, closes):
    """A function that opens a page, with the server's token unless another is given."""
    return lambda token=live.token, **headers: closes(WebSocket(port, token, **headers))


def posted(port: int, name: str, body: str = "", **headers: str) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    connection.request("POST", f"/{name}", body, headers)
    status = connection.getresponse().status
    connection.close()
    return status


NO_REQUEST = [
    *map(TextMessage, ["[]", "5", "null", "true", '"stop"', "{", "[" * 4_000, "{}", '{"do": "stop"}']),
    BytesMessage(b'{"id": 1, "do": "stop"}'),
    TextMessage("x" * (LARGEST_MESSAGE + 1)),
]


@pytest.mark.parametrize("sent", NO_REQUEST, ids=lambda sent: repr(sent.data[:20]))
def test_what_is_no_request_ends_its_page_alone_and_does_nothing(page, live, sent):
    one, other = page(), page()
    one.state()
    one.send(sent)
    assert [message for message in one.messages(5) if "id" in message] == []
    if isinstance(sent, TextMessage) and len(sent.data) <= LARGEST_MESSAGE:
        assert "not a valid request" in one.closed.reason
    assert one.closed is not None
    assert live.pilot.stops == []
    assert other.state()["robot"] == "connecting"


NO_GAIT, UNKNOWN, NO_CHOICE = "a gait needs period_s", "run, clear, apply", "true or false"


@pytest.mark.parametrize(
    ("do", "more", "told"),
    [
        *(("draft", {"gait": gait}, NO_GAIT) for gait in (None, [], {}, {"period_s": 4})),
        *((do, {}, UNKNOWN) for do in ("dance", None, [], {}, ["stop"])),
        *(("closing", {"stop": stop}, NO_CHOICE) for stop in ("false", 0, None, [])),
    ],
)
def test_what_makes_no_sense_is_refused_with_what_would_and_the_page_is_heard_on(page, live, do, more, told):
    one = page()
    assert told in one.answer(one.ask(do, **more))["error"]
    assert live.state.content["stops_when_closed"]
    assert "keeps going" in one.answer(one.ask("closing", stop=False))["said"]
    assert not live.state.content["stops_when_closed"]


@pytest.mark.parametrize("body", ["", "{}", "[]", "{", "[" * 100_000])
def test_a_stop_stops_whatever_comes_with_it(port, live, body):
    assert posted(port, "stop", body) == 200
    assert len(live.pilot.stops) == 1


@pytest.mark.parametrize("token", [None, "of-an-earlier-server"])
def test_a_stop_needs_no_token_and_all_else_does(page, port, live, token):
    one = page(token)
    you = one.state()["you"]
    assert (you["is_owner"], you["is_stale"]) == (False, token is not None)
    for name in ("run", "apply", "save", "clear", "load", "closing", "draft"):
        assert "open the page by the address" in one.answer(one.ask(name, stop=False, gait={}))["error"]
    assert live.pilot.stops == []
    assert "confirms" in one.answer(one.ask("stop"))["said"]
    assert posted(port, "stop") == 200
    assert len(live.pilot.stops) == 2


@pytest.mark.parametrize("origin", ["http://evil.example", "null"])
def test_a_page_from_elsewhere_is_not_heard(page, port, live, origin):
    """Requests from a page of another site or from a file are refused."""
    one = page(live.token, Origin=origin)
    assert list(one.messages(5)) == []
    assert one.closed is not None
    assert posted(port, "stop", Host="evil.example") == 400
    assert live.pilot.stops == []


def test_strangers_make_room_for_whoever_comes(port, page):
    owner = page()
    owner.state()
    idle = [socket.create_connection(("127.0.0.1", port)) for _ in range(3 * MAX_STRANGERS)]
    try:
        begun_s = time.monotonic()
        assert posted(port, "stop") == 200
        assert time.monotonic() - begun_s < 4.0, "before the idle connections time out"
        assert owner.answer(owner.ask("stop"))["said"]
        gone = [one for one in idle if _is_closed(one)]
        assert len(idle) - len(gone) <= MAX_STRANGERS
    finally:
        for one in idle:
            one.close()


def test_who_never_ends_his_headers_is_left_after_a_while(port):
    with socket.create_connection(("127.0.0.1", port), timeout=20) as slow:
        slow.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        begun_s = time.monotonic()
        assert _is_closed(slow, 15.0)
        assert 3.0 < time.monotonic() - begun_s < 12.0


def test_who_does_not_read_the_page_does_not_make_the_server_hold_it(port, live):
    """The page is sent in pieces as it is read, so that a client that never reads holds back only one or two."""
    with socket.create_connection(("127.0.0.1", port), timeout=20) as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        time.sleep(0.5)
        [transport] = live.gate.strangers
        assert transport.get_write_buffer_size() < 300_000
        assert posted(port, "stop") == 200


def test_a_page_may_come_while_the_last_reports_are_waited_for(live):
    class Messages:
        def empty(self) -> bool:
            live.pages.add(Slow())  # as another thread does
            return True

    class Slow:
        messages = Messages()

    live.pages.add(Slow())
    live.flush(0.1)
    assert len(live.pages) > 1


def test_a_robot_that_begins_to_walk_after_the_last_page_was_closed_is_stopped(live, page, monkeypatch):
    """As by a request that a bad cable delayed."""
    monkeypatch.setattr(server, "_RELOAD_WINDOW_S", 0.1)
    stranger, owner = page(None), page()
    owner.state()
    live.tell({"robot": "idle"}, [])
    owner.close()
    time.sleep(0.5)
    live.tell({"robot": "running"}, [])
    stranger.until(lambda state: state["robot"] == "running")
    assert live.pilot.stops == ["the last page was closed"]
    page().state()
    live.tell({"robot": "running", "warning": "none"}, [])
    stranger.until(lambda state: "warning" in state)
    assert len(live.pilot.stops) == 1, "somebody watches again"


def test_every_page_is_told_the_same(live, page):
    one, other = page(), page(None)
    seen = one.state(), other.state()
    live.tell({"robot": "idle", "parameters": nominal_gait(), "presets": {"baseline": False}}, [sample(1.0)])
    live.tell({"robot": "idle"}, [sample(1.1)])
    states = [watcher.until(lambda state: state["prediction"]) for watcher in (one, other)]
    assert seen[0]["you"]["number"] != seen[1]["you"]["number"]
    assert states[0] == states[1]
    assert states[0]["draft"]["gait"] == nominal_gait()
    late = page()
    message = next(late.messages())
    assert message["whole"]
    assert [round(one["t"], 1) for one in message["samples"]] == [1.0, 1.1]
    assert message["version"] == live.state.version
    one.ask("draft", gait=nominal_gait() | {"period_s": 4.0})
    shown = other.until(lambda state: state["prediction"]["gait"]["period_s"] == 4.0)
    assert shown["draft"]["gait"]["period_s"] == 4.0
    assert shown["draft"]["by"] == seen[0]["you"]["number"]
    told = other.until(lambda state: "predicted" in state["prediction"])["prediction"]
    assert float(told["predicted"].split()[0]) == pytest.approx(told["speed_mm_s"], rel=0.1)
    assert "if it walks, with probability" in told["predicted"]


def nominal_gait() -> dict[str, float]:
    return BASELINE.as_dict()


def sample(t: float) -> dict:
    return {"t": t, "psi": (0.0, 0.0, 0.0), "valves": ("off", "off", "off")}


def _is_closed(one: socket.socket, timeout_s: float = 0.2) -> bool:
    one.settimeout(timeout_s)
    try:
        while one.recv(65536):
            pass
        return True
    except TimeoutError:
        return False
    except ConnectionError:
        return True
