"""What a verdict drops: effects that may be absent, unless much is explained worse without them."""

from types import SimpleNamespace

import pytest
from toy import hide

from lacuna.diagnosis.case import Case
from lacuna.diagnosis.decide import weigh
from lacuna.diagnosis.named import drop_absent
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.search import Search
from lacuna.diagnosis.split import split_trials
from lacuna.estimation.fit import fit, starting_point
from lacuna.estimation.structure import Structure

OPEN = (-1.0, 1.0)  # an interval that holds 0


@pytest.mark.parametrize(("true_s", "stays"), [(0.03, True), (0.0, False)])
def test_an_effect_with_an_open_interval_stays_only_where_much_is_worse_without_it(monkeypatch, true_s, stays):
    system = hide({"delay.delay_s": true_s}, seed=33)
    case = Case(system, split_trials(system.trials, system.spare()), POLICY, 0)
    base = case.judge(case.fit_base(1))
    structure, floor = Structure(system, ("delay",)), base.fitted.problem.floor
    start = [starting_point(base.fitted, structure)]
    delayed = case.judge(fit(structure, case.split.fit, floor, starts=start))
    found = Search(base, floor, (base, delayed), ())
    monkeypatch.setattr(Case, "intervals", lambda self, candidate: dict.fromkeys(candidate.fitted.theta, OPEN))
    kept = drop_absent(case, found, weigh(found, delayed, POLICY))
    assert kept.candidate.effects == (("delay",) if stays else ())
    monkeypatch.setattr(Case, "intervals", lambda self, candidate: dict.fromkeys(candidate.fitted.theta, (0.01, 0.05)))
    assert drop_absent(case, found, SimpleNamespace(candidate=delayed)).candidate is delayed
