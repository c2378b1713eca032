"""`bifa monitor --web` in a real browser, against the Uno's own code: slider, apply, stop, robot gone, page closed."""

import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bifa.robot.gait import Gait, save_gait
from harness.pty_uno import PtyUno
from harness.web_monitor import WebMonitor
from harness.web_socket import WebSocket

pytestmark = pytest.mark.real_time

expect = pytest.importorskip("playwright.sync_api", reason="playwright is not installed").expect

LOOKS = (Path(__file__).parents[1] / "report" / "looks.js").read_text(encoding="utf-8")

PATIENCE_MS = 60_000  # predictions run at the lowest priority


@pytest.fixture
def monitor(closes):
    return lambda *options, **where: closes(WebMonitor(*options, **where))


@pytest.fixture
def walking(monitor):
    """A monitor whose robot walks."""
    bifa = monitor("--run")
    assert bifa.until("running")
    return bifa


@pytest.fixture
def tab(browser, closes):
    def open_tab(url):
        page = closes(browser.new_context(viewport={"width": 1280, "height": 900})).new_page()
        page.complaints = []
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.on("console", lambda message: page.complaints.append(message.text))
        page.goto(url)
        page.wait_for_selector("html[data-drawn]", state="attached")
        return page

    return open_tab


def stop_on(page):
    """Press the page's Stop, and wait until it says that the valves are off."""
    page.get_by_role("button", name="Stop", exact=True).click()
    page.get_by_text("the Uno confirms that all valves are off").wait_for()


def test_a_slider_predicts_apply_changes_the_robot_and_stop_says_when_it_has(walking, tab):
    page = tab(walking.url)
    predicted = page.locator("#predicted")
    expect(predicted).to_contain_text("10.8", timeout=PATIENCE_MS)
    page.locator("input[name=period_s]").fill("4.5")
    expect(predicted).not_to_contain_text("10.8")
    expect(predicted).to_have_text(re.compile(r"predicts \d+\.\d\d mm/s.*; \d+\.\d\d mm of slip"), timeout=PATIENCE_MS)
    assert walking.gait()["period_s"] == pytest.approx(5.7), "the robot changes only on Apply"
    box = page.locator(":has(> input[name=duty_body]) > input[type=number]")
    duty = box.input_value()
    box.fill("")
    expect(page.get_by_role("button", name="Apply")).to_be_disabled()  # an empty box would be 0
    box.fill(duty)
    page.get_by_role("button", name="Apply").click()
    page.get_by_text("applied;").wait_for()
    assert walking.gait()["period_s"] == pytest.approx(4.5)
    page.get_by_label("name of the preset").fill("slow-1")
    page.get_by_role("button", name="Save as preset").click()
    page.get_by_text("saved as slow-1").wait_for()

    stop_on(page)
    assert (walking.uno.board.state, walking.uno.board.valves) == ("stopped", 0)
    expect(page.locator("#alarm")).to_contain_text("Stopped by this page at")
    expect(page.get_by_role("button", name="Walk")).to_be_disabled()
    page.get_by_role("button", name="Release the stop").click()
    page.get_by_text("released").wait_for()
    page.get_by_role("button", name="Walk").click()
    assert walking.until("running")
    assert page.complaints == []

    assert walking.interrupt() == 0
    assert (walking.uno.board.state, walking.uno.board.valves) == ("stopped", 0)


def test_a_robot_that_is_gone_is_said_and_waited_for_and_never_walks_by_itself(monitor, tab, tmp_path):
    port = tmp_path / "port"
    first, second = PtyUno(), PtyUno()
    port.symlink_to(first.device)
    bifa = monitor("--run", port=str(port), uno=first)
    page = tab(bifa.url)
    first.unplug()
    expect(page.locator("#state")).to_have_text("the link to the robot is lost")
    expect(page.locator("#alarm")).to_have_text(re.compile(f"^{port} is gone; plug the Uno in again"))
    assert page.locator("#alarm").evaluate("box => box.classList.contains('loud')")
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.locator("#said")).to_contain_text("NOT CONFIRMED")
    assert page.get_by_role("button", name="Walk").is_disabled()
    port.unlink()
    port.symlink_to(second.device)
    expect(page.locator("#alarm")).to_contain_text("does not walk by itself", timeout=30_000)
    page.wait_for_timeout(1_000)
    assert second.driven_s == 0
    page.get_by_role("button", name="Walk").click()
    bifa.uno = second
    assert bifa.until("running")
    assert bifa.process.poll() is None
    bifa.interrupt()
    assert second.board.valves == 0


def test_a_server_that_ends_while_the_robot_is_gone_leaves_no_page_that_waits_for_it(walking, tab):
    page = tab(walking.url)
    walking.uno.unplug()
    expect(page.locator("#state")).to_have_text("the link to the robot is lost")
    walking.process.kill()
    expect(page.locator("#state")).to_have_text("not connected")
    expect(page.locator("#alarm")).to_contain_text("bifa monitor does not answer; the data shown are old.")
    expect(page.locator("#alarm")).to_contain_text("is gone; plug the Uno in again")


def test_a_robot_that_is_gone_while_nobody_watches_ends_the_command(walking):
    walking.uno.unplug()
    assert walking.process.wait(30) == 2
    said = walking.process.stdout.read()
    assert "is gone" in said
    assert "MAY STILL BE MOVING" in said


def test_who_ends_it_while_a_robot_that_may_move_is_gone_is_not_told_that_the_valves_are_off(walking):
    page = WebSocket(walking.port, walking.token)
    walking.uno.unplug()
    page.until(lambda state: state["gone"])
    assert walking.interrupt() == 2
    *_, last = walking.process.stdout.read().splitlines()
    assert last.startswith("THE ROBOT MAY STILL BE MOVING")
    page.close()


def test_a_closed_page_stops_the_robot_or_not_as_the_person_chose(walking, tab):
    page = tab(walking.url + "   (Ctrl-C closes it and stops the robot)")  # copied with the rest of its line
    page.get_by_label("When the last page closes").uncheck()
    page.get_by_text("the robot keeps going").wait_for()
    page.close()
    time.sleep(4.5)
    assert walking.uno.board.state == "running"
    page = tab(walking.url)
    assert not page.get_by_label("When the last page closes").is_checked()
    page.get_by_label("When the last page closes").check()
    page.get_by_text("the robot stops").last.wait_for()
    page.reload()
    page.wait_for_selector("html[data-drawn]", state="attached")
    time.sleep(4.5)
    assert walking.uno.board.state == "running", "a reloaded page does not count as closed"
    page.close()
    assert walking.until("stopped")
    assert walking.uno.board.valves == 0


def test_who_has_no_token_may_look_and_stop_and_nothing_else(walking, tab):
    page = tab(walking.origin)
    page.get_by_text("View and stop only").wait_for()
    for name in ("Walk", "Apply", "Load", "Save as preset", "Release the stop"):
        assert page.get_by_role("button", name=name, exact=True).is_disabled()
    page.close()
    time.sleep(4.5)
    assert walking.uno.board.state == "running", "a page without a token changes nothing by closing"
    page = tab(walking.origin)
    stop_on(page)
    assert (walking.uno.board.state, walking.uno.board.valves) == ("stopped", 0)


def test_a_stranger_does_not_keep_it_walking(walking, tab):
    stranger = WebSocket(walking.port)
    tab(walking.url).close()
    assert walking.until("stopped")
    stranger.close()


@pytest.mark.parametrize("key", ["Escape", "!"])
def test_keys_stop(walking, tab, key):
    page = tab(walking.url)
    page.locator("input[name=period_s]").focus()
    page.keyboard.press(key)
    page.get_by_text("the Uno confirms that all valves are off").wait_for()
    assert walking.uno.board.valves == 0


def test_a_page_of_an_earlier_server_says_so_and_still_stops(monitor, tab):
    earlier = monitor()
    page = tab(earlier.url)
    earlier.interrupt()
    expect(page.locator("#alarm")).to_contain_text("the data shown are old")
    assert page.get_by_role("button", name="Walk").is_disabled()
    bifa = monitor("--run", "--web-port", str(earlier.port))
    assert bifa.until("running")
    expect(page.locator("#alarm")).to_contain_text("This page belongs to an earlier bifa monitor")
    assert page.get_by_role("button", name="Walk").is_disabled()
    assert float(page.locator("#alarm").evaluate("box => parseFloat(getComputedStyle(box).fontSize)")) > 20
    stop_on(page)
    assert bifa.uno.board.valves == 0
    page.goto(bifa.url)  # as the page asks; only what follows the # differs
    expect(page.get_by_role("button", name="Release the stop")).to_be_enabled()


def test_two_tabs_show_the_same(walking, tab):
    one, other = tab(walking.url), tab(walking.url)
    expect(other.locator("#predicted")).to_contain_text("10.8", timeout=PATIENCE_MS)
    one.locator("input[name=period_s]").fill("4.5")
    for page in (one, other):
        expect(page.locator("#predicted")).not_to_contain_text("10.8")
        expect(page.locator("#unsent")).to_contain_text("Not sent")
        expect(page.locator("[data-robot=period_s]")).to_have_text("5.7")
        expect(page.locator("input[name=period_s]")).to_have_value("4.5")
    other.get_by_role("button", name="Apply").click()
    for page in (one, other):
        expect(page.locator("[data-robot=period_s]")).to_have_text("4.5")
        expect(page.locator("#unsent")).to_contain_text("robot's gait", timeout=10_000)
    one.get_by_label("presets on the robot").select_option("obstacle")
    one.get_by_role("button", name="Load", exact=True).click()
    for page in (one, other):
        expect(page.locator("[data-robot=period_s]")).to_have_text("6")
        expect(page.locator("input[name=period_s]")).to_have_value("6")
    one.get_by_role("button", name="Stop", exact=True).click()
    expect(one.locator("#alarm")).to_contain_text("Stopped by this page at")
    expect(other.locator("#alarm")).to_contain_text("Stopped by page ")
    assert one.complaints + other.complaints == []


def test_of_a_robot_that_stands_the_plot_begins_when_the_uno_does_and_closing_the_last_page_does_nothing(monitor, tab):
    bifa = monitor()
    page = tab(bifa.url)
    assert page.evaluate("Chart.getChart(document.querySelector('#plot canvas')).scales.x.min") >= 0.0
    page.close()
    time.sleep(4.5)
    assert bifa.uno.board.state == "idle"


def test_the_page_is_legible_wide_and_narrow_light_and_dark(walking, tab):
    page = tab(walking.url)
    for width in (1280, 390):
        for scheme in ("light", "dark"):
            page.set_viewport_size({"width": width, "height": 900})
            page.emulate_media(color_scheme=scheme)
            page.wait_for_timeout(300)
            assert page.evaluate(LOOKS) == []


CONTROLS = r"- (?:button|slider|spinbutton|combobox|textbox|checkbox|progressbar)\b.*"


def test_who_hears_the_page_is_told_what_every_control_is(walking, tab):
    page = tab(walking.url)
    heard = page.locator("body").aria_snapshot()
    controls = re.findall(CONTROLS, heard)
    assert len(controls) >= 6 + 6 + 3 + 8
    assert [control for control in controls if not re.match(r'- \w+ "[^"]+"', control)] == []
    assert len(re.findall(r"- (?:status|alert)\b", heard)) <= 5, "only news is announced"
    assert not re.search(r"\d\.\d{5}", heard), "numbers are rounded"


def test_the_keyboard_alone_sets_a_gait_and_stops(walking, tab):
    page = tab(walking.url)
    expect(page.locator("input[name=period_s]")).to_be_enabled()
    focused = "document.activeElement.id || document.activeElement.name || document.activeElement.dataset.do"
    reached = []
    while "apply" not in reached:
        page.keyboard.press("Tab")
        reached.append(page.evaluate(focused))
        assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none", reached
        if reached[-1] == "period_s":
            page.keyboard.press("ArrowRight")
        assert len(reached) < 30
    assert reached[:2] == ["stop", "period_s"], "Stop comes first"
    page.keyboard.press("Enter")
    page.get_by_text("applied;").wait_for()
    assert walking.gait()["period_s"] > 5.7
    for _ in reached[1:]:
        page.keyboard.press("Shift+Tab")
    assert page.evaluate(focused) == "stop"
    page.keyboard.press("Space")
    assert walking.until("stopped")
    assert page.complaints == []


def test_a_port_that_is_taken_is_refused_with_what_to_do(monitor, uno):
    taken = str(monitor().port)
    command = [sys.executable, "-m", "bifa", "monitor", "--web", "--web-port", taken, "--port", uno.device]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=30)
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
    stop_on(page)
