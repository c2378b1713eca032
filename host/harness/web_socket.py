"""A page of `bifa monitor --web` without a browser: what it sends and receives over its websocket."""

import json
import socket
import time
from collections import deque
from collections.abc import Iterator

from wsproto import ConnectionType, WSConnection
from wsproto.events import AcceptConnection, CloseConnection, Message, Ping, RejectConnection, Request, TextMessage


class WebSocket:
    """A websocket connected to 127.0.0.1:`port`; `token` is offered as the page offers it."""

    def __init__(self, port: int, token: str | None = None, host: str = "127.0.0.1", **headers: str) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=20)
        self._wire = WSConnection(ConnectionType.CLIENT)
        self._number = 0
        self._text = ""
        self._come: deque[dict] = deque()
        self._is_accepted = False
        self.closed: CloseConnection | RejectConnection | None = None
        offered = ["bifa", *([token] if token else [])]
        extra = [(name.encode(), value.encode()) for name, value in headers.items()]
        self.send(Request(host=f"{host}:{port}", target="/live", subprotocols=offered, extra_headers=extra))
        while not self._is_accepted and self.closed is None:
            self._listen(20.0)

    def send(self, event: Message | Request) -> None:
        self._socket.sendall(self._wire.send(event))

    def ask(self, do: str, **more) -> int:
        """Send a request; return its number."""
        self._number += 1
        self.send(TextMessage(json.dumps({"id": self._number, "do": do, **more})))
        return self._number

    def messages(self, timeout_s: float = 20.0) -> Iterator[dict]:
        """Messages received, until the connection is closed (see `closed`) or `timeout_s` has passed."""
        until_s = time.monotonic() + timeout_s
        while True:
            while self._come:
                yield self._come.popleft()
            if self.closed is not None or time.monotonic() > until_s:
                return
            self._listen(until_s - time.monotonic())

    def _listen(self, timeout_s: float) -> None:
        self._socket.settimeout(max(timeout_s, 0.01))
        try:
            data = self._socket.recv(65536)
        except TimeoutError:
            return
        except ConnectionError:
            data = b""
        self._wire.receive_data(data or None)
        for event in self._wire.events():
            if isinstance(event, TextMessage):
                self._text += event.data
                if event.message_finished:
                    self._come.append(json.loads(self._text))
                    self._text = ""
            elif isinstance(event, Ping):
                self.send(event.response())
            elif isinstance(event, CloseConnection | RejectConnection):
                self.closed = event
            elif isinstance(event, AcceptConnection):
                self._is_accepted = True

    def state(self, timeout_s: float = 20.0) -> dict:
        """The next state received, with the message's `you`, or None."""
        message = next(message for message in self.messages(timeout_s) if "state" in message)
        return message["state"] | {"you": message.get("you")}

    def until(self, condition, timeout_s: float = 20.0) -> dict:
        """The first state for which condition(state) holds."""
        return next(m["state"] for m in self.messages(timeout_s) if "state" in m and condition(m["state"]))

    def answer(self, number: int, timeout_s: float = 20.0) -> dict:
        """The answer to a request."""
        return next(message for message in self.messages(timeout_s) if message.get("id") == number)

    def close(self) -> None:
        self._socket.close()
