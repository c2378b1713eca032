"""Detection of PlatformIO's registry, tested with local servers that answer well, badly, or not at all."""

import http.server
import socket
import threading

import pytest
from provision import registry

DEADLINE_S = 2.0


@pytest.fixture(autouse=True)
def no_proxy(monkeypatch):
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")


@pytest.fixture
def serve():
    """A function that starts a server with a fixed status and body, and returns its address."""
    servers = []

    def start(status: int, body: bytes) -> str:
        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(status)
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_):
                """Keep the test output clean."""

        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        servers.append(server)
        return f"http://127.0.0.1:{server.server_port}/v3/packages/platformio/platform/atmelavr"

    yield start
    for server in servers:
        server.shutdown()
        server.server_close()


@pytest.fixture
def silent():
    """An address that accepts connections but never answers."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}/"


@pytest.fixture
def closed():
    """An address without a listener."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    return f"http://127.0.0.1:{port}/"


@pytest.mark.parametrize(
    ("status", "body", "is_answer"),
    [
        (200, b'{"name": "atmelavr"}', True),
        (403, b'{"name": "atmelavr"}', False),
        (200, b"<html>sign in first</html>", False),
        (200, b'{"message": "no"}', False),
        (502, b"", False),
    ],
)
def test_a_described_package_is_an_answer_and_a_page_of_something_in_between_is_none(serve, status, body, is_answer):
    assert registry.answers([serve(status, body)], DEADLINE_S) == is_answer


def test_one_good_mirror_suffices(serve, closed, silent):
    assert registry.answers([closed, silent, serve(200, b'{"name": "atmelavr"}')], DEADLINE_S)


def test_nobody_there_is_no_answer(closed):
    assert not registry.answers([closed, closed], DEADLINE_S)


def test_a_silent_registry_is_given_up_at_the_deadline(silent):
    assert not registry.answers([silent, silent], deadline_s=0.2)


def test_a_hanging_name_resolution_is_given_up_too(monkeypatch):
    forever = threading.Event()
    monkeypatch.setattr(registry.requests, "get", lambda *_, **__: forever.wait())
    assert not registry.answers(["http://nowhere.invalid/"], deadline_s=0.2)


def test_the_mirrors_asked_are_those_of_platformio_itself():
    urls = registry.package_urls()
    assert urls
    assert all(url.startswith("https://api.") for url in urls)
