"""The choice between PlatformIO's registry and stand-ins is made once, kept while it is valid, and reported in one
line; the registry is detected, here with local servers that answer well, badly, or not at all."""

import http.server
import socket
import sys
import threading

import pytest
from provision import __main__ as provisioning
from provision import decision, registry, stand_ins
from provision.decision import Decision


@pytest.fixture
def world(core_dir, monkeypatch):
    """A project in a temporary folder; installations are only noted."""
    done = []
    monkeypatch.delenv("PLATFORMIO_CORE_DIR", raising=False)
    monkeypatch.setattr(sys, "argv", ["provision"])
    monkeypatch.setattr(provisioning, "CORE_DIR", core_dir)
    monkeypatch.setattr(provisioning, "install_from_registry", lambda: done.append("registry"))
    monkeypatch.setattr(provisioning, "install_avr_tools", lambda: done.append("avr"))
    monkeypatch.setattr(stand_ins, "lay_out", lambda folder: done.append("stand-ins"))
    return done


@pytest.mark.parametrize(
    ("answers", "installed", "line"),
    [
        (True, ["registry"], "PlatformIO packages: from PlatformIO's registry\n"),
        (False, ["avr", "stand-ins"], "PlatformIO packages: stand-ins in .platformio"),
    ],
)
def test_the_registry_decides_and_one_line_says_so(world, monkeypatch, capsys, answers, installed, line):
    monkeypatch.setattr(registry, "answers", lambda urls: answers)
    assert provisioning.main() == 0
    assert world == installed
    out = capsys.readouterr().out
    assert out.startswith(line)
    assert out.count("\n") == 1


def test_the_second_time_nothing_is_asked_or_installed(world, monkeypatch, core_dir):
    monkeypatch.setattr(registry, "answers", lambda urls: False)
    provisioning.main()
    world.clear()
    monkeypatch.setattr(registry, "answers", lambda urls: pytest.fail("asked again"))
    assert provisioning.main() == 0
    assert world == []


def test_going_back_to_the_registry_removes_the_stand_ins_settings(world, monkeypatch, core_dir):
    (core_dir / stand_ins.SETTINGS_FILE).write_text(stand_ins.SETTINGS)
    monkeypatch.setattr(registry, "answers", lambda urls: True)
    provisioning.main()
    assert not (core_dir / stand_ins.SETTINGS_FILE).exists()


def test_a_foreign_core_directory_is_refused_not_hidden_behind(world, monkeypatch, capsys):
    monkeypatch.setattr(registry, "answers", lambda urls: False)
    monkeypatch.setenv("PLATFORMIO_CORE_DIR", "/somewhere/else")
    assert provisioning.main() == 1
    assert "PLATFORMIO_CORE_DIR is set" in capsys.readouterr().err
    assert world == []


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"source": "stand-ins"}', '{"source": "x", "fingerprint": "old"}'])
def test_a_decision_that_does_not_fit_is_forgotten(core_dir, text):
    (core_dir / decision.FILE).write_text(text)
    assert decision.remembered(core_dir) is None


def test_a_moved_project_is_provisioned_anew(core_dir, tmp_path):
    Decision("stand-ins", decision.fingerprint(core_dir)).save(core_dir)
    assert decision.remembered(core_dir) is not None
    moved = core_dir.rename(tmp_path / "moved")
    assert decision.remembered(moved) is None


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


def test_one_good_mirror_suffices_and_without_one_the_registry_is_given_up_at_the_deadline(serve):
    one, other = (socket.create_server(("127.0.0.1", 0)) for _ in range(2))
    closed, silent = (f"http://127.0.0.1:{listener.getsockname()[1]}/" for listener in (one, other))
    one.close()
    with other:  # it accepts connections but never answers
        assert registry.answers([closed, silent, serve(200, b'{"name": "atmelavr"}')], DEADLINE_S)
        assert not registry.answers([closed, closed], DEADLINE_S)
        assert not registry.answers([silent, silent], deadline_s=0.2)


def test_a_hanging_name_resolution_is_given_up_too(monkeypatch):
    forever = threading.Event()
    monkeypatch.setattr(registry.requests, "get", lambda *_, **__: forever.wait())
    assert not registry.answers(["http://nowhere.invalid/"], deadline_s=0.2)


def test_the_mirrors_asked_are_those_of_platformio_itself():
    urls = registry.package_urls()
    assert urls
    assert all(url.startswith("https://api.") for url in urls)
