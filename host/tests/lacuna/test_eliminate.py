"""Backward elimination drops an effect that may be absent unless the fit is much worse without it, and one that a
learnt curve can replace unless its own formula does most of the work."""

from dataclasses import replace

import pytest
from toy import NOBODY, case_of, hide, with_effect

from lacuna.diagnosis.case import Case
from lacuna.diagnosis.decide import weigh
from lacuna.diagnosis.learn import free_form
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.revise import eliminate
from lacuna.diagnosis.search import Search

OPEN, SURE = (-1.0, 1.0), (0.01, 0.05)  # intervals with and without 0


@pytest.mark.parametrize(("true_s", "stays"), [(0.03, True), (0.0, False)])
def test_an_effect_with_an_open_interval_stays_only_where_much_is_worse_without_it(monkeypatch, true_s, stays):
    case = case_of(hide({"delay.delay_s": true_s}, seed=33))
    base, delayed = with_effect(case, "delay")
    found = Search(base, base.fitted.problem.floor, (base, delayed), ())
    monkeypatch.setattr(Case, "intervals", lambda self, candidate: dict.fromkeys(candidate.fitted.theta, OPEN))
    _, kept = eliminate(case, found, weigh(found, delayed, POLICY))
    assert kept.candidate.effects == (("delay",) if stays else ())
    monkeypatch.setattr(Case, "intervals", lambda self, candidate: dict.fromkeys(candidate.fitted.theta, SURE))
    assert eliminate(case, found, weigh(found, delayed, POLICY))[1].candidate is delayed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "stays"),
    [({"ripple.force_N": 0.3}, False), ({"cubic_spring.stiffness_N_m3": 8000.0, "ripple.force_N": 0.1}, True)],
)
def test_an_effect_stays_beside_a_curve_only_if_its_formula_does_most_of_the_work(monkeypatch, truth, stays):
    monkeypatch.setattr(Case, "intervals", lambda self, candidate: dict.fromkeys(candidate.fitted.theta, SURE))
    system = hide(truth, seed=34)
    cubic_spring = replace(system.effects["cubic_spring"], freed_at=("spring",))
    case = case_of(replace(system, effects={"cubic_spring": cubic_spring}))
    base, cubic = with_effect(case, "cubic_spring")
    freed = free_form(cubic, case.split, NOBODY)
    found = Search(base, base.fitted.problem.floor, (base, cubic), (), (freed,))
    found, kept = eliminate(case, found, weigh(found, cubic, POLICY))
    assert kept.candidate is (cubic if stays else base)
    if not stays:
        assert not found.freed[0].effects
        assert found.freed[0].fitted.structure.sites == ("spring",)
        assert kept.explanation is found.freed[0]
