"""The live page's server, for this computer only: anyone here may watch and may stop the robot; all else requires the
page's token.

A page sends and receives everything over one websocket, so that a stop never waits behind other requests; from there,
a stop also has a path of its own to the port (bifa.live.web.pilot.Stopper).
"""

import asyncio
import contextlib
import gc
import http.client
import itertools
import json
import secrets
import socket
import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from bifa.errors import BifaError
from bifa.link import Uno
from bifa.live.web.gate import ACCEPTED_AT_ONCE, LARGEST_HEADERS, LARGEST_MESSAGE, Gate
from bifa.live.web.pilot import MOVING, BusyError, NotConnectedError, Pilot, wall_clock
from bifa.live.web.predicting import GaitPrediction, lower_priority
from bifa.ranges import RANGES
from bifa.robot import Model
from bifa.robot.gait import GAIT_NAMES, Gait

HOST = "127.0.0.1"
PROTOCOL = "bifa"  # subprotocol of the websocket; the token is offered as another
_ANSWER_S = 15.0  # longest time that a page waits for the robot
_RELOAD_WINDOW_S = 3.0  # a page that comes back within this time was reloaded, not closed
_FLUSH_POLL_S = 0.05
_MAX_QUEUED = 64  # messages by which a slow page may lag
_PIECE = 64 * 1024
SHOWN_S = 20.0


class ServerError(BifaError):
    """The page cannot be served there."""


class BadRequestError(ServerError):
    """An invalid request, which the page itself would never send."""


@dataclass(frozen=True)
class Address:
    """Address of the page; the token follows the #, so that it appears in no log."""

    port: int
    token: str

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.port}/#{self.token}"


@dataclass(eq=False)
class OpenPage:
    """An open page. `is_owner`: it has shown the token."""

    number: int
    is_owner: bool
    messages: asyncio.Queue[str] = field(default_factory=lambda: asyncio.Queue(_MAX_QUEUED))
    answers: set[asyncio.Task[None]] = field(default_factory=set)

    def tell(self, message: Mapping[str, Any] | str) -> None:
        """Queue a message; a page that is too slow misses the oldest."""
        if self.messages.full():
            self.messages.get_nowait()
        self.messages.put_nowait(message if isinstance(message, str) else json.dumps(message))


class LiveState:
    """The state that every page shows, with a version that grows with every change. `content`: everything but samples,
    as plain types; `samples`: those of the last SHOWN_S."""

    def __init__(self, **content: Any) -> None:
        self.version = 0
        self.content: dict[str, Any] = content
        self.samples: deque[dict[str, Any]] = deque()

    def change(self, changes: Mapping[str, Any], samples: Sequence[dict[str, Any]] = ()) -> dict[str, Any]:
        """Apply `changes`, and return the message for the pages, with the new samples."""
        self.version += 1
        self.content |= changes
        for sample in samples:
            if self.samples and sample["t"] < self.samples[-1]["t"]:  # the Uno has restarted
                self.samples.clear()
            self.samples.append(sample)
        while self.samples and self.samples[-1]["t"] - self.samples[0]["t"] > SHOWN_S:
            self.samples.popleft()
        return {"version": self.version, "state": self.content, "samples": list(samples)}

    def whole(self) -> dict[str, Any]:
        """Return the message for a page that has no state yet, or whose samples are void."""
        return {"version": self.version, "state": self.content, "samples": list(self.samples), "whole": True}


class LivePage:
    """The page, the state that it shows, and the requests that viewers send to the robot."""

    def __init__(self, pilot: Pilot, page: str, model: Model) -> None:
        """page: the HTML document; model: the model that predicts the speeds."""
        self.pilot, self._page, self._model = pilot, page.encode(), GaitPrediction(model)
        self.token = secrets.token_urlsafe(16)
        self.gate = Gate()
        self.pages: set[OpenPage] = set()
        self._is_left = False  # the last page was closed, and none has come back
        self._numbers = itertools.count(1)
        self.loop: asyncio.AbstractEventLoop | None = None  # the server's, which sends to the pages
        self._predictor = ThreadPoolExecutor(1, "predictor", lower_priority)
        self._predictor.submit(lambda: self._model.predictor)  # draw its robots before the first request
        self._prediction: asyncio.Task[None] | None = None
        self.state = LiveState(
            robot="connecting",
            gone="",
            model=model.name,
            ranges={name: RANGES[name] for name in GAIT_NAMES},
            stops_when_closed=True,
            draft=None,
            prediction=None,
        )

    def is_watched(self) -> bool:
        """Whether a page that has shown the token is open; callable from any thread."""
        return any(page.is_owner for page in list(self.pages))

    def tell(self, changes: dict[str, Any], samples: list[dict[str, Any]]) -> None:
        """Send to every page; callable from any thread."""
        if self.loop is not None:
            with contextlib.suppress(RuntimeError):  # the server has just ended
                self.loop.call_soon_threadsafe(self._take_report, changes, samples)

    def flush(self, timeout_s: float = 1.0) -> None:
        """Wait until every page has been sent everything, at most `timeout_s`."""
        until_s = time.monotonic() + timeout_s
        time.sleep(_FLUSH_POLL_S)
        while any(not page.messages.empty() for page in list(self.pages)) and time.monotonic() < until_s:
            time.sleep(_FLUSH_POLL_S)

    def app(self) -> Starlette:
        """Return the application with its routes."""
        return Starlette(
            routes=[
                Route("/", self._show),
                Route("/stop", self._stop_by_request, methods=["POST"]),
                WebSocketRoute("/live", self._live),
            ],
            # refuse pages of other sites that reach this address by a host name of their own (DNS rebinding)
            middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=[HOST, "localhost"])],
        )

    # -- the state --------------------------------------------------------------------------------------------

    def _take_report(self, changes: dict[str, Any], samples: list[dict[str, Any]]) -> None:
        """Take over the robot's part of the state."""
        self._change(changes, samples)
        self._stop_if_left()
        if self.state.content["draft"] is None and "parameters" in changes:
            self._draft(_of_gait(changes["parameters"]), by=0)

    def _change(self, changes: Mapping[str, Any], samples: Sequence[dict[str, Any]] = ()) -> None:
        message = json.dumps(self.state.change(changes, samples))
        for page in self.pages:
            page.tell(message)

    def _draft(self, gait: dict[str, float], by: int) -> str:
        """Set the gait on the sliders, which the robot does not have yet, and predict its speed: one gait at a time,
        the newest last."""
        self._change({"draft": {"gait": gait, "by": by}})
        if self._prediction is None or self._prediction.done():
            self._prediction = asyncio.ensure_future(self._predict())
        return ""

    async def _predict(self) -> None:
        asked = None
        while asked != (asked := self.state.content["draft"]["gait"]):
            for look in (self._model.at_once, self._model.in_full):
                loop = asyncio.get_running_loop()
                found = await loop.run_in_executor(self._predictor, look, Gait(**asked))
                self._change({"prediction": {**found, "gait": asked}})
                if asked != self.state.content["draft"]["gait"]:
                    break

    # -- looking ----------------------------------------------------------------------------------------------

    async def _show(self, request: Request) -> Response:
        headers = {
            "Content-Security-Policy": "default-src 'self' 'unsafe-inline'; img-src 'self' data:; "
            "frame-ancestors 'none'",
            "Content-Length": str(len(self._page)),
            "Connection": "close",  # one request per connection: no client can queue several
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
        }
        return StreamingResponse(_in_pieces(self._page), media_type="text/html", headers=headers)

    async def _live(self, socket: WebSocket) -> None:
        origin = socket.headers.get("origin", "")
        if origin and origin.partition("://")[2] != socket.headers.get("host"):
            await socket.close(1008)  # a page of another site
            return
        given = [name for name in socket.scope["subprotocols"] if name != PROTOCOL]
        page = OpenPage(next(self._numbers), any(secrets.compare_digest(one, self.token) for one in given))
        await socket.accept(PROTOCOL if PROTOCOL in socket.scope["subprotocols"] else None)
        if page.is_owner and socket.client is not None:
            self.gate.prove(socket.client)
        you = {"number": page.number, "is_owner": page.is_owner, "is_stale": bool(given) and not page.is_owner}
        page.tell({"you": you} | self.state.whole())
        self.pages.add(page)
        self._is_left = self._is_left and not page.is_owner
        sending = asyncio.create_task(_send(socket, page))
        try:
            while True:
                self._handle(page, await socket.receive_text())
        except (WebSocketDisconnect, RuntimeError):
            pass
        except (BadRequestError, KeyError) as error:  # KeyError: bytes instead of text
            with contextlib.suppress(WebSocketDisconnect, RuntimeError):
                await socket.close(1007, str(error))
        finally:
            sending.cancel()
            self.pages.discard(page)
            if page.is_owner and not self.is_watched():
                asyncio.get_running_loop().call_later(_RELOAD_WINDOW_S, self._closed)

    def _closed(self) -> None:
        self._is_left = not self.is_watched()
        self._stop_if_left()

    def _stop_if_left(self) -> None:
        """Stop a robot that moves, or that a late request sets in motion, after the last page was closed. A robot at
        rest is left alone."""
        moves = self.state.content["robot"] in MOVING
        if self._is_left and moves and self.state.content["stops_when_closed"]:
            self.pilot.stop("the last page was closed")

    # -- asking -----------------------------------------------------------------------------------------------

    def _handle(self, page: OpenPage, text: str) -> None:
        """Handle one request of a page: {"id": 1, "do": "apply", ...}; the answer has the same id."""
        try:
            asked = json.loads(text)
            number, name = asked["id"], str(asked["do"])
        except (ValueError, KeyError, TypeError, RecursionError):
            raise BadRequestError('not a valid request: send {"id": 1, "do": "stop"}') from None
        if name == "stop":
            self._answer_later(page, number, self._stop(f"page {page.number}"))
        elif not page.is_owner:
            page.tell({"id": number, "error": "open the page by the address that bifa monitor printed"})
        else:
            self._dispatch(page, number, name, asked)

    def _dispatch(self, page: OpenPage, number: Any, name: str, asked: Mapping[str, Any]) -> None:
        actions: dict[str, Callable[[], Awaitable[str] | str]] = {
            "run": lambda: _reply_when_done(self.pilot.ask(Uno.run), "walking"),
            "clear": lambda: _reply_when_done(self.pilot.ask(Uno.clear), "released: the robot may walk again"),
            "apply": lambda: self._upload(_gait(asked)),
            "save": lambda: self._upload(_gait(asked), str(asked.get("preset", ""))),
            "load": lambda: self._load(str(asked.get("preset", ""))),
            "draft": lambda: self._draft(_gait(asked).as_dict(), page.number),
            "closing": lambda: self._closing(asked),
        }
        try:
            if name not in actions:
                raise BadRequestError(f"unknown request {name!r}; a page may ask for stop, {', '.join(actions)}")
            said = actions[name]()
        except BifaError as error:
            page.tell({"id": number, "error": str(error)})
            return
        if isinstance(said, str):
            page.tell({"id": number, "said": said})
        else:
            self._answer_later(page, number, said)

    def _answer_later(self, page: OpenPage, number: Any, answer: Awaitable[str]) -> None:
        async def answering() -> None:
            page.tell({"id": number, **(await _response_to(answer))[1]})

        task = asyncio.ensure_future(answering())
        page.answers.add(task)
        task.add_done_callback(page.answers.discard)

    def _upload(self, gait: Gait, preset: str | None = None) -> Awaitable[str]:
        said = f"saved as {preset}" if preset is not None else "applied; a walking robot adopts it at its next cycle"
        return _reply_when_done(self.pilot.ask(lambda uno: uno.upload(gait.as_dict(), save=preset), changes=True), said)

    def _load(self, preset: str) -> Awaitable[str]:
        def load(uno: Uno) -> dict[str, float]:
            uno.load(preset)
            return uno.parameters()

        loaded = self.pilot.ask(load, changes=True)

        async def shown() -> str:
            said = await _reply_when_done(loaded, f"loaded {preset}; a walking robot adopts it at its next cycle")
            self._draft(_of_gait(loaded.result()), by=0)
            return said

        return shown()

    def _closing(self, asked: Mapping[str, Any]) -> str:
        stop = asked.get("stop")
        if not isinstance(stop, bool):
            raise BadRequestError("stop must be true or false")
        self._change({"stops_when_closed": stop})
        return f"when the last page closes, the robot {'stops' if stop else 'keeps going'}"

    def _stop(self, by: str) -> Awaitable[str]:
        """Send a stop before returning; the answer comes when the Uno has confirmed it."""
        future = self.pilot.stop(by)

        async def confirmed() -> str:
            await asyncio.wait_for(asyncio.shield(asyncio.wrap_future(future)), _ANSWER_S)
            return f"stopped at {wall_clock()}: the Uno confirms that all valves are off"

        return confirmed()

    async def _stop_by_request(self, request: Request) -> Response:
        """Stop the robot, whatever the request contains and whoever sends it."""
        status, answer = await _response_to(self._stop("a request to /stop"))
        return JSONResponse(answer, status, {"Connection": "close"})


async def _in_pieces(content: bytes) -> AsyncIterator[bytes]:
    """Yield the page in pieces, so that little is buffered for a client that reads slowly or never, and others get
    their turn."""
    for begin in range(0, len(content), _PIECE):
        yield content[begin : begin + _PIECE]
        await asyncio.sleep(0)


async def _send(socket: WebSocket, page: OpenPage) -> None:
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        while True:
            await socket.send_text(await page.messages.get())


async def _reply_when_done(future: Future[Any], said: str) -> str:
    """Return `said` once the request is done. A request that has not begun in time is cancelled, so that it is not
    carried out later without the page's knowledge."""
    await asyncio.wait_for(asyncio.wrap_future(future), _ANSWER_S)
    return said


def _gait(asked: Mapping[str, Any]) -> Gait:
    given = asked.get("gait")
    if not isinstance(given, Mapping) or set(given) != set(GAIT_NAMES):
        raise BadRequestError(f"a gait needs {', '.join(GAIT_NAMES)}")
    return Gait(**given)


def _of_gait(parameters: Mapping[str, float]) -> dict[str, float]:
    """Return a gait's values, rounded as the sliders show them."""
    return {name: round(parameters[name], 4) for name in GAIT_NAMES}


async def _response_to(said: Awaitable[str]) -> tuple[int, dict[str, Any]]:
    """Return the HTTP status and the content of the answer to a request."""
    try:
        return 200, {"said": await said}
    except BadRequestError as error:
        return 400, {"error": str(error)}
    except (NotConnectedError, BusyError) as error:
        return 503, {"error": str(error)}
    except BifaError as error:
        return 409, {"error": str(error)}
    except (CancelledError, asyncio.CancelledError):
        return 409, {"error": "cancelled: a stop came first"}
    except TimeoutError:
        return 504, {"error": "the robot does not answer"}


def _warm_up(port: int) -> None:
    """Make the first request and a full garbage collection now; later, the imports of the one and the duration of the
    other would delay a stop by a tenth of a second."""
    with contextlib.suppress(OSError, http.client.HTTPException):
        connection = http.client.HTTPConnection(HOST, port, timeout=10)
        connection.request("GET", "/")
        connection.getresponse().read()
        connection.close()
    gc.collect()
    gc.freeze()


@contextmanager
def served(live: LivePage, port: int = 0) -> Iterator[Address]:
    """Serve the page in a thread of its own while the block runs; port 0 takes any free port."""
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
        listener.listen()  # clients that connect before the server is up wait
    except OSError as error:
        raise ServerError(
            f"port {port} of this computer cannot be opened ({error}); choose another with --web-port"
        ) from None
    config = uvicorn.Config(
        live.app(),
        http=live.gate.http,
        ws=live.gate.websocket,
        ws_max_size=LARGEST_MESSAGE,
        ws_per_message_deflate=False,  # a few compressed bytes could become megabytes
        h11_max_incomplete_event_size=LARGEST_HEADERS,
        timeout_keep_alive=2,
        proxy_headers=False,  # take the client's address from the socket, not from headers
        backlog=ACCEPTED_AT_ONCE,
        log_level="error",
        lifespan="off",
        timeout_graceful_shutdown=1,
        access_log=False,
    )
    server = uvicorn.Server(config)
    started = threading.Event()

    async def serve() -> None:
        live.loop = asyncio.get_running_loop()
        started.set()
        await server.serve([listener])

    thread = threading.Thread(target=lambda: asyncio.run(serve()), daemon=True)
    thread.start()
    started.wait()
    try:
        address = Address(listener.getsockname()[1], live.token)
        _warm_up(address.port)
        listener.listen()  # undo the server's small backlog, which also limits how many it accepts at once
        yield address
    finally:
        live.flush()
        server.should_exit = True
        thread.join(5.0)
        listener.close()
