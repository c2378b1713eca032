"""Limits on connections to the live page's server, so that strangers never keep the robot's owner waiting.

A connection is a stranger's until it has shown the token. When there are too many strangers, the oldest is cut off, so
that every newcomer is served: a stop needs no token. All of this runs in the server's event loop.
"""

import asyncio
from collections.abc import Callable
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.wsproto_impl import WSProtocol

MAX_STRANGERS = 32
HEADERS_WITHIN_S = 5.0
ANSWERED_WITHIN_S = 20.0  # a request and its answer; websockets may stay longer
LARGEST_HEADERS = 16 * 1024
LARGEST_MESSAGE = 4 * 1024
ACCEPTED_AT_ONCE = 4  # connections accepted before the loop serves the others


class Gate:
    """Tracks strangers' connections; `http` and `websocket` are the protocol classes for uvicorn."""

    def __init__(self) -> None:
        self.strangers: dict[asyncio.Transport, asyncio.TimerHandle] = {}  # oldest first

        self.http = _observed(H11Protocol, self._enter, self._forget)
        self.websocket = _observed(WSProtocol, self._keep_open, self._forget)

    def prove(self, client: tuple[str, int]) -> None:
        """Record that the connection from `client` has shown the token."""
        for transport in [t for t in self.strangers if t.get_extra_info("peername") == tuple(client)]:
            self._forget(transport)

    def _enter(self, http: H11Protocol) -> None:
        while len(self.strangers) >= MAX_STRANGERS:
            self._end(next(iter(self.strangers)))
        loop = asyncio.get_running_loop()
        self.strangers[http.transport] = loop.call_later(HEADERS_WITHIN_S, self._look_for_headers, http)

    def _look_for_headers(self, http: H11Protocol) -> None:
        transport = http.transport
        if http.scope is None:
            self._end(transport)
        elif transport in self.strangers:
            left_s = ANSWERED_WITHIN_S - HEADERS_WITHIN_S
            self.strangers[transport] = asyncio.get_running_loop().call_later(left_s, self._end, transport)

    def _keep_open(self, websocket: WSProtocol) -> None:
        if timer := self.strangers.get(websocket.transport):
            timer.cancel()

    def _end(self, transport: asyncio.Transport) -> None:
        self._forget(transport)
        transport.abort()

    def _forget(self, transport: asyncio.Transport) -> None:
        if timer := self.strangers.pop(transport, None):
            timer.cancel()


def _observed(protocol: Any, on_made: Callable[[Any], None], on_lost: Callable[[asyncio.Transport], None]) -> Any:
    """Derive from a protocol of uvicorn one that tells when its connection is made or lost."""

    class Observed(protocol):  # type: ignore[misc]
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            on_made(self)

        def connection_lost(self, error: Exception | None) -> None:
            on_lost(self.transport)
            super().connection_lost(error)

    return Observed
