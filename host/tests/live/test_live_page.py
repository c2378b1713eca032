"""`bifa monitor --web` in a real browser, against the Uno's own code: slider, apply, stop, robot gone, page closed."""

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from bifa.robot.gait import Gait, save_gait
from harness.pty_uno import PtyUno

pytestmark = pytest.mark.real_time

expect = pytest.importorskip("playwright.sync_api", reason="playwright is not installed").expect

LOOKS = (Path(__file__).parents[1] / "report" / "looks.js").read_text(encoding="utf-8")


class Monitor:
    """The command, the Uno that it talks to, and its page's address."""

    def __init__(self, *options, port=None):
        self.uno = PtyUno() if port is None else None
        command = [sys.executable, "-m", "bifa", "monitor", "--web", "--web-port", "0"]
        command += ["--port", port or self.uno.device]
        environment = os.environ | {"PYTHONUNBUFFERED": "1"}
        self.process = subprocess.Popen(
            [*command, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
        )
        self.said = self.process.stdout.readline()
        self.url = re.search(r"http://\S+", self.said)[0]
        self.origin, self.token = self.url.split("/#")

    def post(self, name, token, **headers):
        """The HTTP status of a write."""
        given = {"Authorization": f"Bearer {token}"} if token else {}
        request = urllib.request.Request(f"{self.origin}/{name}", b"{}", given | headers, method="POST")
        try:
            return urllib.request.urlopen(request, timeout=20).status
        except urllib.error.HTTPError as error:
            return error.code

    def gait(self):
        """What the Uno has."""
        with urllib.request.urlopen(f"{self.origin}/setup", timeout=20) as answer:
            return json.load(answer)["gait"]

    def until(self, state, timeout_s=10.0):
        """Wait for the board's state."""
        end_s = time.monotonic() + timeout_s
        while self.uno.board.state != state and time.monotonic() < end_s:
            time.sleep(0.02)
        return self.uno.board.state

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        if self.uno:
            self.uno.unplug()


@pytest.fixture
def monitor():
    started = []

    def start(*options, **where):
        started.append(Monitor(*options, **where))
        return started[-1]

    yield start
    for one in started:
        one.close()


@pytest.fixture
def tab(browser):
    contexts = []

    def open_tab(url, **options):
        contexts.append(browser.new_context(viewport={"width": 1280, "height": 900}, **options))
        page = contexts[-1].new_page()
        page.complaints = []
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.on("console", lambda message: page.complaints.append(message.text))
        page.goto(url)
        page.wait_for_selector("html[data-drawn]", state="attached")
        return page

    yield open_tab
    for context in contexts:
        context.close()


def test_a_slider_predicts_apply_changes_the_robot_and_stop_says_when_it_has(monitor, tab):
    bifa = monitor("--run")
    page = tab(bifa.url)
    assert bifa.until("running") == "running"
    predicted = page.locator("#predicted")
    expect(predicted).to_contain_text("10.8")
    page.locator("input[name=period_s]").fill("4.5")
    expect(predicted).not_to_contain_text("10.8")
    assert re.search(r"predicts \d+\.\d\d mm/s, with \d+\.\d\d mm of slip", predicted.inner_text())
    assert bifa.gait()["period_s"] == pytest.approx(5.7), "nothing changes before it is applied"
    page.get_by_role("button", name="Apply").click()
    page.get_by_text("applied;").wait_for()
    assert bifa.gait()["period_s"] == pytest.approx(4.5)
    page.get_by_label("name of the preset").fill("slow-1")
    page.get_by_role("button", name="Save as preset").click()
    page.get_by_text("saved as slow-1").wait_for()

    page.get_by_role("button", name="Stop", exact=True).click()
    page.get_by_text("the Uno confirms that all valves are off").wait_for()
    assert (bifa.uno.board.state, bifa.uno.board.valves) == ("stopped", 0)
    page.get_by_role("button", name="Walk").click()
    page.get_by_text("refused").wait_for()
    page.get_by_role("button", name="Release the stop").click()
    page.get_by_text("released").wait_for()
    page.get_by_role("button", name="Walk").click()
    assert bifa.until("running") == "running"
    assert [line for line in page.complaints if "409" not in line] == []

    bifa.process.send_signal(signal.SIGINT)
    assert bifa.process.wait(15) == 0
    assert (bifa.uno.board.state, bifa.uno.board.valves) == ("stopped", 0)


def test_the_page_says_that_the_robot_is_gone(monitor, tab):
    bifa = monitor("--run")
    page = tab(bifa.url)
    bifa.uno.unplug()
    page.locator("#state", has_text="the robot is gone").wait_for()
    assert bifa.process.wait(20) == 2
    assert "is gone" in bifa.process.stdout.read()
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.locator("#said")).to_contain_text("NOT CONFIRMED")


def test_a_closed_page_stops_the_robot_or_not_as_the_person_chose(monitor, tab):
    bifa = monitor("--run")
    page = tab(bifa.url)
    page.get_by_label("When this page closes").uncheck()
    page.get_by_text("the robot goes on").wait_for()
    page.close()
    time.sleep(4.5)
    assert bifa.uno.board.state == "running"
    page = tab(bifa.url)
    assert not page.get_by_label("When this page closes").is_checked()
    page.get_by_label("When this page closes").check()
    page.get_by_text("the robot stops").last.wait_for()
    page.reload()
    page.wait_for_selector("html[data-drawn]", state="attached")
    time.sleep(4.5)
    assert bifa.uno.board.state == "running", "a page that is loaded anew was not closed"
    page.close()
    assert bifa.until("stopped") == "stopped"
    assert bifa.uno.board.valves == 0


def test_nobody_writes_without_the_token_or_from_elsewhere(monitor, tab, browser, tmp_path):
    bifa = monitor("--run")
    bifa.until("running")
    for name in ("stop", "run", "apply", "save", "clear", "closing", "predict"):
        assert bifa.post(name, None) == 403
        assert bifa.post(name, "guessed") == 403
    assert bifa.uno.board.state == "running"
    assert bifa.post("stop", bifa.token, Host="evil.example") == 400
    assert bifa.uno.board.state == "running"
    page = tab(bifa.origin)
    page.get_by_text("Only to look at").wait_for()
    assert page.get_by_role("button", name="Walk").is_disabled()
    elsewhere = tmp_path / "elsewhere.html"
    elsewhere.write_text("<!doctype html><title>elsewhere</title>")
    page.goto(elsewhere.as_uri())
    heard = page.evaluate(
        """url => new Promise((done) => {
            const socket = new WebSocket(url);
            socket.onmessage = () => done("heard");
            socket.onerror = socket.onclose = () => done("refused");
        })""",
        f"{bifa.origin.replace('http', 'ws')}/live",
    )
    assert heard == "refused"
    assert bifa.post("stop", bifa.token) == 200
    assert bifa.uno.board.valves == 0


def test_the_page_is_legible_wide_and_narrow_light_and_dark(monitor, tab):
    page = tab(monitor("--run").url)
    for width in (1280, 390):
        for scheme in ("light", "dark"):
            page.set_viewport_size({"width": width, "height": 900})
            page.emulate_media(color_scheme=scheme)
            page.wait_for_timeout(300)
            assert page.evaluate(LOOKS) == []


def test_a_port_that_is_taken_is_refused_with_what_to_do(monitor):
    bifa = monitor()
    port = bifa.origin.rpartition(":")[2]
    other = PtyUno()
    try:
        command = [sys.executable, "-m", "bifa", "monitor", "--web", "--web-port", port, "--port", other.device]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=30)
    finally:
        other.unplug()
    assert ended.returncode == 2
    assert "--web-port" in ended.stderr


@pytest.mark.uno
def test_on_the_virtual_rig_the_page_shows_position_and_speed(monitor, tab, tmp_path):
    gait = tmp_path / "gait.toml"
    save_gait(gait, Gait(2.72, 204.5, 331.7, 0.6535, 0.439, 0.439), {})
    page = tab(monitor("--run", "--gait", str(gait), port="virtual").url)
    shown = page.locator("#speed")
    expect(shown).to_contain_text("mm/s over the last cycle", timeout=60_000)
    page.wait_for_timeout(6_000)
    assert 15 < float(shown.inner_text().split()[0]) < 30
    page.get_by_role("button", name="Stop", exact=True).click()
    page.get_by_text("the Uno confirms that all valves are off").wait_for()
