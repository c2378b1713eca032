"""Sensitivity of verdicts to the decision rules: the table, and that a decisive rule shows in it."""

from benchmarks.sensitivity import names_under, table, variants
from benchmarks.small.draw import drawn
from lacuna.diagnosis.policy import POLICY

AS_IT_IS = ("", 1.0)


def test_every_rule_of_decision_is_halved_and_doubled():
    policies = variants()
    assert policies["gain", 0.5].gain == POLICY.gain / 2
    assert policies["gain", 2.0].share == POLICY.share
    assert policies["supported", 2.0].supported == 0.99  # a probability stays below 1
    assert ("promising", 2.0) not in policies  # a setting of the search, not a rule of decision


def test_a_share_of_the_gap_that_no_effect_reaches_takes_its_name_away():
    offered, sealed = drawn("single", 32005)
    said = names_under(offered, {("half", 2.0): variants()["half", 2.0], ("gain", 0.5): variants()["gain", 0.5]})
    assert said[AS_IT_IS] == said["gain", 0.5] == tuple(sealed.effects)
    assert said["half", 2.0] == ("unexplained",)


def test_the_table_counts_what_changes_and_which_way():
    unchanged = {key: ("a",) for key in (AS_IT_IS, *variants())}
    worse, better = unchanged | {("share", 2.0): ("none",)}, unchanged | {("share", 2.0): ("b",)}
    text = table([(("a",), worse), (("b",), better), (("a",), unchanged)])
    (row,) = [line for line in text.splitlines() if line.startswith("share ")]
    assert row.split()[-6:] == ["0", "(0,", "0)", "2", "(1,", "1)"]
