"""lacuna, used as its documentation shows."""

import lacuna
from benchmarks.systems.problem import KnownProblem, RivalAnswer


def solve(problem: KnownProblem) -> RivalAnswer:
    """Diagnose with default settings; the engine splits the records itself."""
    system = lacuna.System(
        problem.simulate, problem.parameters, problem.effects, nuisances=problem.nuisances, outputs=problem.output
    )
    verdict = lacuna.diagnose(system, problem.cut(problem.fitted), progress=False)
    named = tuple(effect.name for effect in verdict.effects)
    return RivalAnswer(named, lambda record: verdict.model(record)[problem.output], verdict.verdict)
