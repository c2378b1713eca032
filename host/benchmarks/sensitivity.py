"""Sensitivity to each decision rule: verdicts that change when the rule's value is halved or doubled.

    python -m benchmarks.sensitivity                                     a fifth of a trial of small systems
    python -m benchmarks.sensitivity --first-seed 32000 --sets 1         all of one

Small systems with repeats (`benchmarks.small_systems`), each searched once by the current rules; then the decision
is repeated with every rule halved and doubled (probabilities at most 0.99). A set counts as right if the verdict
names exactly the effects that are present and offered.
"""

import argparse
import time
from collections import Counter
from dataclasses import Field, fields, replace

from benchmarks.small.draw import UntellableError, drawn
from benchmarks.small.offered import Offered
from benchmarks.small_systems import COUNTS, compiled, jobs
from lacuna.diagnosis.case import Case
from lacuna.diagnosis.diagnose import decide, explanations
from lacuna.diagnosis.policy import POLICY, Policy
from lacuna.diagnosis.split import split_trials
from lacuna.diagnosis.workers import Stoppable, Workers
from lacuna.run import with_records

SEARCH = ("implausible", "promising", "rival", "reach", "lost", "curve")  # rules of the search or of a curve
FACTORS = (0.5, 2.0)

Named = tuple[str, ...]  # effects that a verdict names, or the verdict itself
Said = dict[tuple[str, float], Named]  # by rule and factor


def _rules() -> list[Field]:
    """The rules of decision."""
    return [rule for rule in fields(Policy) if rule.name not in SEARCH]


def variants() -> dict[tuple[str, float], Policy]:
    """By rule and factor, the policy with only that rule changed."""
    found = {}
    for rule in _rules():
        for factor in FACTORS:
            value = getattr(POLICY, rule.name) * factor
            if rule.metadata["unit"] in ("probability", "weight"):
                value = min(value, 0.99)
            found[rule.name, factor] = replace(POLICY, **{rule.name: value})
    return found


def names_under(offered: Offered, policies: dict[tuple[str, float], Policy]) -> Said:
    """What the verdict names under each policy; `("", 1.0)`: under the current rules."""
    system = with_records(offered.system(), offered.tables)
    case = Case(system, split_trials(system.trials, system.spare(), system.test()), POLICY, 0)
    hand = Stoppable(Workers(lambda _: None))
    found = explanations(case, case.fit_base(1), hand)
    said = {}
    for key, policy in {("", 1.0): POLICY, **policies}.items():
        _, choice, judged = decide(case.with_policy(policy) if key[0] else case, found, hand)
        named = sorted(choice.candidate.effects) if judged.verdict == "identified" else [judged.verdict]
        said[key] = tuple(named)
    return said


def table(every: list[tuple[Named, Said]]) -> str:
    """A table of rules: value, unit, and for half and double of it the number of verdicts that change, become right,
    and become wrong. `every`: for each set, what is right, and what was named by policy."""
    rows = [f"{len(every)} sets, verdicts that change (of these: to right, to wrong)\n"]
    rows.append(f"{'rule':18}{'value':>8}  {'unit':44}{'halved':>16}{'doubled':>16}")
    for rule in _rules():
        cells = "".join(f"{_changed(every, (rule.name, factor)):>16}" for factor in FACTORS)
        rows.append(f"{rule.name:18}{getattr(POLICY, rule.name):8.3g}  {rule.metadata['unit']:44}{cells}")
    return "\n".join(rows)


def _changed(every: list[tuple[Named, Said]], key: tuple[str, float]) -> str:
    counts: Counter[str] = Counter()
    for right, said in every:
        before, after = said["", 1.0], said[key]
        if before != after:
            counts["all"] += 1
            counts["right"] += after == right
            counts["wrong"] += before == right
    return f"{counts['all']} ({counts['right']}, {counts['wrong']})"


def main(given: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first-seed", type=int, default=32000, metavar="SEED")
    parser.add_argument("--sets", type=int, default=5, metavar="N", help="one set in N of a full trial")
    options = parser.parse_args(given)
    compiled()
    every, policies, began = [], variants(), time.monotonic()
    todo = jobs({truth: -(-count // options.sets) for truth, count in COUNTS.values()}, options.first_seed)
    for count, (truth, seed) in enumerate(todo, 1):
        try:
            offered, sealed = drawn(truth, seed)
        except UntellableError:
            continue
        if sealed.repeats < 2:
            continue
        said = names_under(offered, policies)
        right = tuple(sorted(sealed.offered)) or (("none",) if not sealed.effects else ("unexplained",))
        every.append((right, said))
        print(f"{count} of {len(todo)}  {time.monotonic() - began:.0f} s  {truth} {seed}", flush=True)
    print("\n" + table(every))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
