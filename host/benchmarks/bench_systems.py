"""lacuna beside what people use instead, on systems whose structural error is known, all in this run.

Same records to fit, same candidates, same simulator for all; nobody sees what is judged by. See docs/compared.md.
"""

from __future__ import annotations

from benchmarks.systems import bouc_wen, emps, spring, tanks
from benchmarks.systems.table import compare


def run() -> dict[str, float]:
    """Print a block for each system; returns the figures flat."""
    hidden = {name.split(".")[0] for name in spring.HIDDEN}
    problems = [spring.problem, lambda: spring.problem(withheld=hidden), lambda: spring.problem(hidden={})]
    problems += [emps.problem, tanks.problem, bouc_wen.problem]
    figures: dict[str, float] = {}
    for made in problems:
        if made is emps.problem and (why := emps.absent()):
            print(f"\nEMPS: skipped, {why}")
            continue
        figures |= compare(made())
    return figures
