"""The pages in a real browser: wide and narrow, light and dark, on paper."""

from pathlib import Path
from unicodedata import normalize

import pytest
from pypdf import PdfReader

from bifa.campaign.side_by_side import compare_page, read_runs
from bifa.report.diagnosis import diagnosis_page
from bifa.report.page import write_page
from bifa.report.style import LIGHT
from lacuna.report import page as engine_page
from lacuna.report.figures import draw_errors
from tests.report import sample

pytestmark = pytest.mark.real_time

LOOKS = Path(__file__).with_name("looks.js").read_text(encoding="utf-8")
WIDE, MIDDLE, NARROW = 1280, 1000, 390
PLACE = "document.querySelector('.walk0-head').getBoundingClientRect().x"
_INK = "document.querySelector('.plot').charts[0].options.scales.x.ticks.color"  # color of the plots' text


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The folder with all pages."""
    folder = tmp_path_factory.mktemp("pages")
    runs = read_runs([sample.finished(tmp_path_factory.mktemp("runs") / day) for day in ("monday", "tuesday")])
    for name, page in {
        "campaign": sample.page(),
        "compare": compare_page(runs),
        "diagnosis": diagnosis_page("the bench", sample.DIAGNOSIS, sample.LABELS, [sample.curves()]),
    }.items():
        write_page(page, folder / f"{name}.html")
    (folder / "engine.html").write_text(engine_page.render(engines_own()), encoding="utf-8")
    return folder


def engines_own():
    """A page of the engine with every element that it can have."""
    error = sample.DIAGNOSIS["error"]
    figure = engine_page.both_palettes(lambda stream, dark: draw_errors(error, stream, dark), "errors")
    table = engine_page.PageTable(("effect", "size", "why"), [("delay", "10 ms", "it says so")], "Named", 0, True)
    sections = [
        engine_page.Section(title, ("One effect.",), (table,), figures=(figure,)) for title in ("Found", "Left", "Next")
    ]
    facts = [("10.3", "error of the base model on trials not fitted, in units of the noise"), ("1.0", "after")]
    return engine_page.Page("Diagnosis of a toy", "A delay.", sections, facts=facts)


@pytest.fixture(scope="module")
def tabs(browser, pages):
    """A tab for each page, drawn, and the list of their complaints."""
    complaints, found = [], {}
    own = [path.as_uri() for path in pages.iterdir()]
    for path in sorted(pages.iterdir()):
        tab = browser.new_context(viewport={"width": WIDE, "height": 900}, accept_downloads=False).new_page()
        tab.on("console", lambda message: complaints.append(message.text))
        tab.on("pageerror", lambda error: complaints.append(str(error)))
        tab.on("request", lambda request: request.url in own or complaints.append(request.url))
        tab.goto(path.as_uri())
        if path.stem != "engine":  # which has no script
            tab.wait_for_selector("html[data-drawn]", state="attached")
        found[path.stem] = tab
    yield found, complaints
    for tab in found.values():
        tab.context.close()


@pytest.fixture
def opened(tabs):
    """opened(name, width, scheme): the page's tab; any complaint fails the test."""
    found, complaints = tabs

    def look(name, width=WIDE, scheme="light", motion="no-preference"):
        tab = found[name]
        tab.set_viewport_size({"width": width, "height": 900})
        tab.emulate_media(color_scheme=scheme, reduced_motion=motion)
        tab.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        return tab

    yield look
    assert complaints == []


@pytest.fixture
def page(opened):
    """The campaign's page, wide and light."""
    return opened("campaign")


@pytest.mark.parametrize("name", ["campaign", "compare", "diagnosis", "engine"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [WIDE, MIDDLE, NARROW])
def test_nothing_overlaps_is_cut_off_or_too_pale(opened, name, width, scheme):
    assert opened(name, width, scheme).evaluate(LOOKS) == []


def test_the_answer_is_on_the_first_screen(page):
    assert page.evaluate("document.querySelector('nav').getBoundingClientRect().bottom") <= 900


def test_a_name_above_a_plot_hides_and_shows_its_curves(page):
    figure = page.locator("figure.chart", has_text="measured").first

    def curves() -> int:
        return figure.evaluate(
            "f => [...f.querySelectorAll('.plot')].flatMap((plot) => plot.charts)"
            ".reduce((sum, chart) => sum + chart.getVisibleDatasetCount(), 0)"
        )

    before = curves()
    button = figure.get_by_role("button", name="base model")
    button.click()
    assert button.get_attribute("aria-pressed") == "false"
    assert 0 < curves() < before
    button.click()
    assert curves() == before


def test_a_plot_zooms_and_comes_back_and_its_column_follows(page):
    several = page.evaluate("[...document.querySelectorAll('.plot')].findIndex((box) => box.charts.length > 1)")
    plot = page.locator(".plot").nth(several)
    plot.scroll_into_view_if_needed()
    reach = "box => box.charts.map(({ scales: { x } }) => [x.min, x.max])"
    whole = plot.evaluate(reach)
    assert len(whole) > 1
    spot = plot.locator("canvas").last.bounding_box()
    y = spot["y"] + spot["height"] / 2
    page.mouse.move(spot["x"] + 0.5 * spot["width"], y)
    page.mouse.down()
    page.mouse.move(spot["x"] + 0.8 * spot["width"], y, steps=5)
    page.mouse.up()
    both = [plot.element_handle(), whole]
    nearer = f"([box, whole]) => ({reach})(box).every(([from, to], k) => from > whole[k][0] && to < whole[k][1])"
    page.wait_for_function(nearer, arg=both)
    plot.dblclick(position={"x": 0.6 * spot["width"], "y": 40})
    back = f"([box, whole]) => JSON.stringify(({reach})(box)) === JSON.stringify(whole)"
    page.wait_for_function(back, arg=both)


def test_a_plot_says_under_the_pointer_what_is_there(page):
    plot = page.locator(".plot").last
    plot.scroll_into_view_if_needed()
    spot = plot.locator("canvas").bounding_box()
    page.mouse.move(spot["x"] + 0.5 * spot["width"], spot["y"] + 0.5 * spot["height"])
    page.mouse.move(spot["x"] + 0.3 * spot["width"], spot["y"] + 0.41 * spot["height"], steps=8)
    handle = plot.element_handle()
    page.wait_for_function("box => box.charts[0].tooltip.body?.[0]?.lines[0].startsWith('baseline')", arg=handle)


def test_the_plots_follow_the_reader_s_scheme(page):
    light = page.evaluate(_INK)
    page.emulate_media(color_scheme="dark")
    page.wait_for_function(f"{_INK} !== {light!r}")
    assert page.evaluate(LOOKS) == []


def test_pages_with_plots_stay_under_a_megabyte(pages):
    for page in pages.iterdir():
        assert page.stat().st_size < 1e6, page.name


def test_the_animation_runs_pauses_and_is_set_by_its_slider(page):
    figure = page.locator(".motion")
    before = page.evaluate(PLACE)
    page.wait_for_function(f"Math.abs({PLACE} - {before}) > 2")
    figure.get_by_role("button", name="Pause").click()
    page.wait_for_timeout(100)
    still = page.evaluate(PLACE)
    page.wait_for_timeout(300)
    assert page.evaluate(PLACE) == still
    slider = figure.locator("input")
    slider.fill("10")
    assert page.evaluate(PLACE) != still
    assert figure.locator("output").inner_text() == "10.0 s"
    slider.press("ArrowRight")
    assert figure.locator("output").inner_text() == "10.1 s"


def test_the_clock_of_the_animation_tells_the_time_at_its_dot(page):
    figure = page.locator(".motion")
    shown = float(figure.get_attribute("data-shown"))
    assert shown > 1.5 * float(figure.get_attribute("data-seconds")), "the walk is shown faster than real time"
    figure.locator("input").fill(f"{0.5 * shown:.1f}")
    dot, line = (
        page.evaluate(
            "s => { const b = document.querySelector(s).getBoundingClientRect(); return [b.x + b.width / 2, b.width] }",
            s,
        )
        for s in (".motion .walk-clock", ".motion svg")
    )
    assert dot[0] == pytest.approx(line[0], abs=0.01 * line[1]), "half of the walk, in the middle of its line"
    assert figure.locator("output").inner_text() == f"{0.5 * shown:.1f} s"
    slider = figure.locator("input")
    slider.fill(str(shown))
    assert figure.locator("output").inner_text() == f"{shown:.1f} s", "its end, not its start again"


def test_the_animation_stands_still_for_who_prefers_that(opened):
    page = opened("campaign", motion="reduce")
    page.reload()
    page.wait_for_selector("html[data-drawn]", state="attached")
    before = page.evaluate(PLACE)
    page.wait_for_timeout(400)
    assert page.evaluate(PLACE) == before
    page.locator(".motion").get_by_role("button", name="Play").click()
    page.wait_for_function(f"Math.abs({PLACE} - {before}) > 2")


def test_on_paper_nothing_is_cut_off_and_no_table_is_split(opened, tmp_path):
    page = opened("campaign", scheme="dark")
    page.evaluate(
        """addEventListener("beforeprint", () => {
        const wide = [...document.querySelectorAll(".plot canvas, table, .motion svg")];
        window.onPaper = {
            widest: Math.max(...wide.map((node) => node.getBoundingClientRect().width)),
            ink: INK,
        };
    })""".replace("INK", _INK)
    )
    tables = [
        [" ".join(row.inner_text().split()) for row in table.locator("tbody tr").all()]
        for table in page.locator("table").all()
    ]
    for height_mm in (297, 279, 250, 215):  # A4, Letter, and sheets that break at other places
        page.pdf(path=tmp_path / "page.pdf", width="210mm", height=f"{height_mm}mm")
        printed = page.evaluate("window.onPaper")
        assert printed["widest"] <= 700, "wider than the printable width of A4"
        assert printed["ink"] == LIGHT["ink"], "dark on white, whatever the screen's scheme"
        sheets = pages_of(tmp_path / "page.pdf")
        for rows in tables:
            on = [{number for number, sheet in enumerate(sheets) if row in sheet} for row in rows]
            assert set.intersection(*on), f"a table is split between sheets of {height_mm} mm: {rows}"


def pages_of(pdf):
    """The text of each sheet, with spaces normalised and ligatures spelt out."""
    return [" ".join(normalize("NFKC", sheet.extract_text()).split()) for sheet in PdfReader(pdf).pages]
