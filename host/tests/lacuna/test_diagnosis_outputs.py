"""The outputs of a diagnosis: a page, a record, and doubts about its verdict."""

from dataclasses import replace
from unittest.mock import Mock

import pytest
from toy import hide

from lacuna.diagnosis.diagnose import diagnose
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.record import as_record
from lacuna.diagnosis.remainder import Remainder
from lacuna.diagnosis.signature import describe
from lacuna.diagnosis.warn import doubts, explains_too_little
from lacuna.report.diagnosis import diagnosis_page
from lacuna.report.page import render

pytestmark = pytest.mark.slow

KEY = ("sweep", "position_mm")


@pytest.fixture(scope="module")
def found():
    return diagnose(hide({"delay.delay_s": 0.02}, seed=30))


def test_page_says_the_effect_and_loads_nothing(found):
    page = render(diagnosis_page("toy", as_record(found)))
    assert "delay" in page
    assert "that the model does not explain: position_mm in sweep" in page
    assert 'src="http' not in page


def test_page_shows_what_was_learnt_where_no_effect_explains_the_data(withheld_spring):
    record = as_record(withheld_spring)
    (curve,) = record["learnt"]
    assert curve["term"] in render(diagnosis_page("toy", record))
    assert curve["rows"][""][-1] * curve["rows"][""][0] < 0.0


def test_page_has_an_interval_without_an_end(found):
    record = as_record(found)
    (effect,) = record["effects"]
    effect["interval_90"]["delay_s"][1] = None
    assert "to -)" in render(diagnosis_page("toy", record))


def test_what_is_named_is_not_what_the_data_would_hardly_show(found):
    blind = [replace(s, visible=0.0) for s in found.search.screened]
    found = replace(found, search=replace(found.search, screened=tuple(blind), tried=found.search.tried[:1]))
    hidden = as_record(found)["not_detectable_here"]
    assert hidden
    assert "delay" not in hidden


def test_the_base_model_is_among_what_was_tried_however_many_explanations_are_better(found):
    better = [Mock(effects=(f"effect {k}",), rms=1.0, cost=-1.0 - k) for k in range(9)]
    record = as_record(replace(found, search=replace(found.search, tried=(found.search.base, *better))))
    assert [one["effects"] for one in record["tried"]] == [*([f"effect {k}"] for k in range(8, 0, -1)), []]


def test_where_something_matters_it_is_told_where(found):
    """The test's probability decides what is listed, however many standard deviations that is."""
    small = Remainder({KEY: 0.5}, {KEY: 2.9}, {KEY: 0.004}, {KEY: 0.0}, POLICY)
    assert small.matters
    assert "position_mm in sweep (0.7 x the floor)" in describe(found.base, small).text


def test_final_records_and_a_likelier_set_speak_against_a_verdict(found):
    assert doubts(found.choice, found.split, 0.9) == []
    (little,) = explains_too_little(found.choice, found.split, 0.3, POLICY)
    assert "by only 30 % of what is missing there: it is not named" in little
    (harm,) = explains_too_little(found.choice, found.split, -0.3, POLICY)
    assert "With delay most records are predicted better, but the test records" in harm
    assert found.split.final[0].name in harm
    assert "too little" in explains_too_little(found.choice, found.split, None, POLICY)[0]
    likelier = replace(found.choice, weights=found.choice.weights | {("delay", "stiction"): 3.0})
    (odds,) = doubts(likelier, found.split, None)
    assert "With stiction added" in odds
