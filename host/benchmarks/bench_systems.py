"""lacuna compared with what people use instead, on systems with a known structural error, all in this run.

All get the same records to fit, candidates and simulator; nobody sees the held-out records. See docs/compared.md.
"""

from benchmarks.systems import bouc_wen, emps, spring, tanks
from benchmarks.systems.table import compare


def run() -> dict[str, float]:
    """Print a block for each system; return the figures flat."""
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
