"""The report page: self-contained, escaped, in words."""

import json
import re
from io import StringIO

import numpy as np
import pytest

from bifa.campaign.page import prediction_table, rounds_section, speed_table
from bifa.cli.diagnose import print_diagnosis
from bifa.effects import library
from bifa.files import TargetError
from bifa.report.animation import FRAMES_PER_S, animate_walks
from bifa.report.diagnosis import diagnosis_page, settings_words, verdict_sentence
from bifa.report.evidence import residual_charts
from bifa.report.page import ChartedSection, Page, PageTable, render, write_page
from bifa.report.style import CHAMBER_COLORS, DARK, LIGHT
from bifa.report.terminal import print_table
from bifa.report.words import effect_words, quantity, spoken
from bifa.robot.gait import BASELINE
from bifa.screen import Console
from tests.report import sample
from tests.report.sample import text_of


@pytest.fixture(scope="module")
def html():
    return render(sample.page())


def test_the_page_fetches_nothing(html):
    own = html.replace(next(iter(re.findall(r"<script>.*?</script>", html, re.DOTALL))), "")
    assert not re.findall(r"https?://(?!www\.w3\.org)", own)
    assert not re.findall(r"\b(?:src|srcset)=", own)
    links = re.findall(r'href="([^"]*)"', own)
    assert links
    assert not [link for link in links if "://" in link or link.startswith("/")]


def test_text_is_escaped():
    page = Page("Bench <today>", "a & b", [ChartedSection("S", tables=[PageTable(["gait"], [["<b>baseline</b>"]])])])
    html = render(page)
    assert "Bench &lt;today&gt;" in html
    assert "&lt;b&gt;baseline" in html
    assert "a &amp; b" in html
    assert "Chart.js" not in html, "a page without plots is small"


def test_no_identifier_is_left_in_what_a_reader_sees(html):
    for page in (html, render(diagnosis_page("bench", sample.DIAGNOSIS, sample.LABELS))):
        assert re.findall(r"\b\w+_\w+\b", text_of(page)) == []


def test_the_first_screen_answers_and_says_what_its_words_mean(html):
    first = text_of(html[: html.index("<main>")])
    for said in (
        "hysteresis, 4.4 N over 2.7 mm",
        "0.481 mm",
        "0.155 psi",
        "3.11 N",
        "20.60 ± 0.01",
        "2026-11-21",
        "bifa campaign --port virtual --seed 0",
        "noise floor is",
        "base model is",
        "completed model includes",
        "Held-out trials",
    ):
        assert said in first, said
    anchors = re.findall(r'href="#([^"]+)"', html)
    assert len(anchors) > 5
    assert all(f'<section id="{anchor}"' in html for anchor in anchors)


def test_each_round_has_its_gait_its_speeds_and_the_last_its_end(html):
    section = text_of(html[html.index('id="gaits-that-were-not-fitted"') :].split("</section>")[0])
    assert "Round 1: the model includes hysteresis; its gait is 2.80 s, head 204° and tail 332° ahead" in section
    assert "Round 2: the model includes hysteresis and valve latency; its gait is 2.61 s" in section
    assert "1 21.40 (21.30 to 21.50; 0.97) 20.60 ± 0.01 (outside) 2.31 0.104 " in section
    assert "2, edge 20.87 (20.77 to 20.97; 0.97) 20.88 ± 0.02 0.117" in section
    assert "The rounds ended after round 2: the speed of its gait is predicted to within the scatter" in section


@pytest.mark.parametrize(
    ("ended", "why"),
    [("unchanged", "predicted no better"), ("falls", "no further gait"), ("most", "at most 3 rounds")],
)
def test_rounds_that_end_without_a_prediction_say_so(ended, why):
    section = rounds_section([*sample.ROUNDS[:1], sample.ROUNDS[1] | {"ended": ended}])
    assert section.paragraphs[-1].startswith("The rounds ended after round 2: ")
    assert why in section.paragraphs[-1]


def test_the_base_model_s_parameters_are_listed_but_not_the_shapes_of_its_curves(html):
    section = text_of(html[html.index('id="parameters-of-the-base-model"') :].split("</section>")[0])
    assert "kinetic friction coefficient 0.3812 0.3795 to 0.3829" in section
    assert "shape" not in section


def test_the_page_says_how_many_robots_do_not_walk_and_explains_the_seal_where_there_is_one(html):
    assert "59 % of 256 robots" in text_of(html)
    assert "keeps it sealed" in text_of(html)
    assert "seal" not in text_of(render(sample.page(sealed=False)))


@pytest.mark.parametrize("verdict", ["none", "unexplained"])
def test_a_verdict_without_an_effect_and_without_held_out_trials_has_its_page(verdict):
    nothing = {"fitted": 1.2, "held_out": None, "held_out_conditions": None, "by_experiment": {"locomotion": 1.2}}
    error = {"before": nothing, "after": nothing, "noise_floor": nothing}
    record = sample.DIAGNOSIS | {"verdict": verdict, "effects": [], "learnt": [], "error": error, "nearest": []}
    page = text_of(render(diagnosis_page("bench", record)))
    assert verdict_sentence(record) in page
    assert "None" not in page


def test_the_page_is_the_same_bytes_every_time(html):
    assert render(sample.page()) == html


def test_a_page_is_written_in_utf_8_whole_or_not_at_all(tmp_path):
    page = Page("±", "4.4 N", [])
    write_page(page, tmp_path / "page.html")
    assert (tmp_path / "page.html").read_bytes().decode("utf-8") == render(page)
    with pytest.raises(TargetError, match="nowhere"):
        write_page(page, tmp_path / "nowhere" / "page.html")
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]


def test_every_plot_is_in_the_page_and_json_cannot_end_its_element(html):
    data = json.loads(re.search(r'id="plots">(.*?)</script>', html, re.DOTALL)[1])
    assert len(data["plots"]) == html.count('class="plot"')
    roles = set(re.findall(r'"colour": "(\w+)"', json.dumps(data["plots"])))
    assert roles <= set(data["light"]) & set(data["dark"])


def test_a_chamber_s_color_is_nobody_else_s():
    for palette in (LIGHT, DARK):
        others = {role: color for role, color in palette.items() if role not in CHAMBER_COLORS}
        assert not set(others.values()) & set(CHAMBER_COLORS.values())


def test_residuals_come_by_quantity_the_largest_first():
    charts = residual_charts(sample.traces())
    assert list(charts) == ["force", "pressure"]
    assert [column.title.split(",")[1] for column in charts["force"].columns] == [" large", " small"]
    assert charts["pressure"].columns[0].title.startswith("walk, period 5.7 s: pressure of the body")


def test_every_effect_has_its_sizes_in_words():
    for name, effect in library().items():
        typical = {p.name: p.typical for p in effect.parameters}
        said = effect_words(name, typical)
        assert "_" not in said
        assert "{" not in said
        size = next(p for p in effect.parameters if p.size)
        assert quantity(size.typical, size.unit) in said


def test_quantities_have_units_that_suit_them():
    said = {quantity(*pair).replace("\N{NO-BREAK SPACE}", " ") for pair in ((0.00274, "m"), (0.06, "s"), (4.4, "N"))}
    assert said == {"2.7 mm", "60 ms", "4.4 N"}


def test_text_of_the_engine_is_spoken():
    assert spoken("force_N in static_loading, mu_s") == "Force in static loading, static friction coefficient"
    assert spoken("see a_1.csv", {"a_1.csv": "walk, period 3 s"}) == "See walk, period 3 s"


def test_the_animation_moves_as_the_record_does():
    columns = sample.columns(2.0, speed_mm_s=10.0)
    svg = animate_walks({"measured": columns}, 6.0, "walk")
    frames = re.search(r"@keyframes walk0-tail\{(.*?)\}\}", svg)[1]
    tail = [float(x) for x in re.findall(r"translate\(([\d.]+)px", frames)]
    assert len(tail) == 6 * FRAMES_PER_S
    way = columns["displacement_tail_mm"][-1] - columns["displacement_tail_mm"][0]
    assert tail[-1] - tail[0] == pytest.approx(way, abs=0.2)
    assert "prefers-reduced-motion" in svg
    assert np.all(np.diff([float(m) for m in re.findall(r">(\d+)(?: mm)?</text>", svg)][:3]) > 0)


def test_the_terminal_says_a_diagnosis_in_words_within_80_columns():
    """The terminal shows the tables and sentences of the page, nothing else, and no identifier."""
    text = StringIO()
    console = Console(file=text, width=80)
    diagnosis = sample.DIAGNOSIS
    print_diagnosis(console, diagnosis, sample.LABELS)
    lines = text.getvalue().splitlines()
    assert lines[0] == "identified"
    assert max(map(len, lines)) <= 80
    assert re.findall(r"\b\w+_\w+\b", text.getvalue()) == []
    said = " ".join(text.getvalue().split())
    for words in (
        "hysteresis, 4.4 N over 2.7 mm",
        "cannot tell it from viscoelasticity",
        "as in static loading, large, 0 psi, 2 mm/s (run 1)",
        "4.39 N to 4.41 N",
        "A further experiment would tell hysteresis from viscoelasticity: static loading, large, 0 psi, 0.5 mm/s.",
    ):
        assert words in said, words
    for table in (speed_table(sample.summary()["gaits"]), prediction_table(sample.PREDICTION_ERRORS)):
        print_table(console, table)
    assert max(map(len, text.getvalue().splitlines())) <= 80


def test_a_baseline_in_the_place_of_a_gait_is_called_so():
    gait = {**sample.summary()["gaits"][0], "gait": "base"}
    found, stands_in = (row[0] for row in speed_table([gait, gait | {"stand_in": "baseline"}]).rows)
    assert (found, stands_in) == ("found with the base model", "baseline: the base model has none")
    other = gait | {"gait": "completed", "stand_in": "base"}
    assert speed_table([other]).rows[0][0] == "the base model's: the completed model has none"


def test_the_lead_praises_only_gaits_that_were_found(monkeypatch):
    given = sample.summary()
    gaits = {gait["gait"]: gait for gait in given["gaits"]}
    gaits["edge"] = gaits["completed"] | {"gait": "edge", "measured": 12.3}

    def lead(without=(), **stand_ins):
        shown = [one | {"stand_in": stand_ins.get(name)} for name, one in gaits.items() if name not in without]
        monkeypatch.setattr(sample, "summary", lambda sealed: given | {"gaits": shown})
        return sample.page().lead

    fastest = f"The gait found with the completed model walks {gaits['completed']['measured']:.1f} mm/s"
    assert fastest in lead()
    assert "The gait found with the completed model walks 12.3 mm/s" in lead(completed="base")
    none = "With the completed model, no gait was found with which enough robots walk."
    assert none in lead(without=("edge",), completed="base")
    assert "With the base model, no gait was found." in lead(base="baseline")
    gaits["baseline"] |= {"measured": 0.2}
    assert "mm/s, while the baseline stands still." in lead()


VACUUM = "vacuum in 0.50 (body), 0.50 (head) and 0.50 (tail) of the cycle"


@pytest.mark.parametrize(
    ("experiment", "settings", "words"),
    [
        ("anchor_pull", {"pressure_psi": 8.5, "direction": "backward"}, "anchor pull, 8.5 psi, backward"),
        ("static_loading", {"actuator": "large", "rate_mm_s": 40.0}, "static loading, large, 40 mm/s"),
        ("locomotion", {"inclination_deg": 10.0}, "walk, pipe at 10 degrees"),
        ("locomotion", {"gait": BASELINE.as_dict()}, f"walk, 5.70 s, head 270° and tail 90° ahead, {VACUUM}"),
    ],
)
def test_an_experiment_is_told_with_its_settings(experiment, settings, words):
    assert settings_words({"experiment": experiment, "settings": settings}).replace("\N{NO-BREAK SPACE}", " ") == words


def test_an_effect_that_would_close_most_of_the_gap_is_named_though_it_is_not_supported():
    tried = [{"effects": ["choked_flow"], "share_of_gap": 0.93}]
    said = verdict_sentence({"verdict": "unexplained", "effects": [], "remainder": {}, "nearest": tried})
    assert "is supported by these data: choked flow would close 93 % of the gap" in said
    assert "no effect of the library explains" not in said
