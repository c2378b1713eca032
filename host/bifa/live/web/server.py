"""The live page's server, on this computer only: anybody here may look, only who has the page's token may write."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from bifa.errors import BifaError
from bifa.live.web.pilot import NobodyThereError, Pilot, wall_clock
from bifa.ranges import RANGES
from bifa.robot import Model
from bifa.robot.gait import GAIT_NAMES, Gait
from bifa.simulate import speed

HOST = "127.0.0.1"
_ANSWER_S = 15.0  # a page waits at most so long for the robot
_BACK_WITHIN_S = 3.0  # a page that is loaded anew has not been closed
_HANDED_OVER_S = 0.05
_WAITING = 64  # reports that a slow page may be behind


class ServerError(BifaError):
    """The page cannot be served there."""


class AskedWrongError(ServerError):
    """A request that the page would not send."""


@dataclass(frozen=True)
class Address:
    """Where the page is; the token is behind the #, so that it is in no log."""

    port: int
    token: str

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.port}/#{self.token}"


class LivePage:
    """The page, its reports to whoever watches, and what they ask of the robot."""

    def __init__(self, pilot: Pilot, page: str, model: Model) -> None:
        """page: the HTML document; model: what predicts the speeds."""
        self._pilot, self._page, self._model = pilot, page, model
        self.token = secrets.token_urlsafe(16)
        self._watchers: set[asyncio.Queue] = set()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._last: dict[str, Any] | None = None
        self.stops_when_closed = True

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """The loop in which the pages are told."""
        self._loop = loop

    def tell(self, report: dict[str, Any]) -> None:
        """To every page; from any thread."""
        if self._loop is not None:
            with contextlib.suppress(RuntimeError):  # the server has just ended
                self._loop.call_soon_threadsafe(self._pass_on, report)

    def flush(self, timeout_s: float = 1.0) -> None:
        """Wait until every page has been told everything, or `timeout_s`."""
        until_s = time.monotonic() + timeout_s
        time.sleep(_HANDED_OVER_S)
        while any(not queue.empty() for queue in list(self._watchers)) and time.monotonic() < until_s:
            time.sleep(_HANDED_OVER_S)

    def _pass_on(self, report: dict[str, Any]) -> None:
        self._last = report
        for queue in self._watchers:
            if queue.full():
                queue.get_nowait()
            queue.put_nowait(report)

    def app(self) -> Starlette:
        """Its routes."""
        doing = {
            "predict": self._predict,
            "run": lambda asked: self._ask(lambda uno: uno.run(), "walking"),
            "clear": lambda asked: self._ask(lambda uno: uno.clear(), "released: it may walk again"),
            "apply": self._apply,
            "save": self._save,
            "stop": self._stop,
            "closing": self._closing,
        }
        return Starlette(
            routes=[
                Route("/", self._show),
                Route("/setup", self._setup),
                WebSocketRoute("/live", self._live),
                *(Route(f"/{name}", self._for_the_owner(name, act), methods=["POST"]) for name, act in doing.items()),
            ],
            # a page elsewhere that has got hold of this address by a name of its own is not answered
            middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=[HOST, "localhost"])],
        )

    # -- looking ----------------------------------------------------------------------------------------------

    async def _show(self, request: Request) -> Response:
        headers = {
            "Content-Security-Policy": "default-src 'self' 'unsafe-inline'; img-src 'self' data:; "
            "frame-ancestors 'none'",
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
        }
        return HTMLResponse(self._page, headers=headers)

    async def _setup(self, request: Request) -> Response:
        def asked() -> dict[str, Any]:
            now = self._pilot.ask(lambda uno: (uno.parameters(), uno.presets())).result(_ANSWER_S)
            return {"gait": {name: now[0][name] for name in GAIT_NAMES}, "presets": list(now[1])}

        ranges = {name: RANGES[name] for name in GAIT_NAMES}
        answer = await run_in_threadpool(_answered, asked)
        return JSONResponse(
            {**answer[1], "ranges": ranges, "model": self._model.name, "stops_when_closed": self.stops_when_closed},
            answer[0],
        )

    async def _live(self, socket: WebSocket) -> None:
        origin = socket.headers.get("origin", "")
        if origin.partition("://")[2] != socket.headers.get("host"):
            await socket.close(1008)  # a page from elsewhere
            return
        await socket.accept()
        queue: asyncio.Queue = asyncio.Queue(_WAITING)
        if self._last is not None:
            queue.put_nowait(self._last)
        self._watchers.add(queue)
        leaving = asyncio.create_task(_left(socket))
        try:
            while not leaving.done():
                report = asyncio.create_task(queue.get())
                await asyncio.wait({report, leaving}, return_when=asyncio.FIRST_COMPLETED)
                if report.done():
                    await socket.send_json(report.result())
                else:
                    report.cancel()
        except (WebSocketDisconnect, RuntimeError):
            pass
        finally:
            leaving.cancel()
            self._watchers.discard(queue)
            if not self._watchers:
                asyncio.get_running_loop().call_later(_BACK_WITHIN_S, self._closed)

    def _closed(self) -> None:
        """The last page is gone, and nobody has come back."""
        if self.stops_when_closed and not self._watchers:
            self._pilot.stop()

    # -- writing ----------------------------------------------------------------------------------------------

    def _for_the_owner(self, name: str, act: Callable[[Mapping[str, Any]], dict[str, Any]]):
        async def handle(request: Request) -> Response:
            given = request.headers.get("authorization", "").removeprefix("Bearer ")
            if not secrets.compare_digest(given.encode(), self.token.encode()):
                return JSONResponse({"error": "open the page by the address that bifa monitor printed"}, 403)
            try:  # a stop is one whatever comes with it
                asked = await request.json() if name != "stop" and await request.body() else {}
            except (ValueError, RecursionError):
                return JSONResponse({"error": "that is no JSON"}, 400)
            if not isinstance(asked, dict):
                return JSONResponse({"error": "send a JSON object, such as {}"}, 400)
            status, answer = await run_in_threadpool(_answered, lambda: act(asked))
            return JSONResponse(answer, status)

        return handle

    def _ask(self, what: Callable, said: str) -> dict[str, Any]:
        asked = self._pilot.ask(what)
        try:
            asked.result(_ANSWER_S)
        except TimeoutError:
            asked.cancel()  # if it has not begun, it is not done behind the page's back
            raise
        return {"said": said}

    def _predict(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        progress = speed(self._model, _gait(asked))
        found = {"speed_mm_s": progress.speed_mm_s, "slip_mm": 1e3 * progress.slip_m[-1]}
        return {name: round(float(value), 2) for name, value in found.items()}

    def _apply(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        gait = _gait(asked)
        return self._ask(lambda uno: uno.upload(gait.as_dict()), "applied; a walking robot takes it at its next cycle")

    def _save(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        gait, name = _gait(asked), str(asked.get("preset", ""))
        return self._ask(lambda uno: uno.upload(gait.as_dict(), save=name), f"saved as {name}")

    def _stop(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        self._pilot.stop().result(_ANSWER_S)
        return {"said": f"stopped at {wall_clock()}: the Uno confirms that all valves are off"}

    def _closing(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        stop = asked.get("stop", True)
        if not isinstance(stop, bool):
            raise AskedWrongError("stop is true or false")
        self.stops_when_closed = stop
        return {"said": f"when this page closes, the robot {'stops' if self.stops_when_closed else 'goes on'}"}


async def _left(socket: WebSocket) -> None:
    with contextlib.suppress(WebSocketDisconnect):
        while True:
            await socket.receive_text()


def _gait(asked: Mapping[str, Any]) -> Gait:
    given = asked.get("gait")
    if not isinstance(given, Mapping) or set(given) != set(GAIT_NAMES):
        raise AskedWrongError(f"a gait has {', '.join(GAIT_NAMES)}")
    return Gait(**given)


def _answered(act: Callable[[], dict[str, Any]]) -> tuple[int, dict[str, Any]]:
    """What came of it, with its HTTP status."""
    try:
        return 200, act()
    except AskedWrongError as error:
        return 400, {"error": str(error)}
    except NobodyThereError as error:
        return 503, {"error": str(error)}
    except BifaError as error:
        return 409, {"error": str(error)}
    except CancelledError:
        return 409, {"error": "not done: a stop came first"}
    except TimeoutError:
        return 504, {"error": "the robot does not answer"}


@contextmanager
def served(live: LivePage, port: int = 0) -> Iterator[Address]:
    """Serve the page in a thread of its own while the block runs; port 0: any that is free."""
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
        listener.listen()  # who comes before the server is up waits
    except OSError as error:
        raise ServerError(
            f"port {port} of this computer cannot be opened ({error}); choose another: --web-port"
        ) from None
    config = uvicorn.Config(
        live.app(), log_level="error", lifespan="off", ws="wsproto", timeout_graceful_shutdown=1, access_log=False
    )
    server = uvicorn.Server(config)
    started = threading.Event()

    async def serve() -> None:
        live.attach(asyncio.get_running_loop())
        started.set()
        await server.serve([listener])

    thread = threading.Thread(target=lambda: asyncio.run(serve()), daemon=True)
    thread.start()
    started.wait()
    try:
        yield Address(listener.getsockname()[1], live.token)
    finally:
        live.flush()
        server.should_exit = True
        thread.join(5.0)
        listener.close()
