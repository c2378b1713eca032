"""An explanation fitted to more data, as long as nothing else is missing: seconds in place of a diagnosis."""

from collections.abc import Callable, Sequence

from lacuna.diagnosis.case import Case
from lacuna.diagnosis.policy import POLICY
from lacuna.diagnosis.split import split_trials
from lacuna.estimation.fit import Fit
from lacuna.estimation.solve import one_thread
from lacuna.system import System, Theta


@one_thread
def refit(
    system: System,
    effects: Sequence[str],
    values: Theta,
    *,
    seed: int = 0,
    on_progress: Callable[[str], None] = lambda _: None,
) -> Fit | None:
    """Fit the base model with `effects` to the trials of `system`, starting at `values` (parameters by name, those of
    an earlier fit to some of the trials). Returns None if it leaves something that matters, or if no trials are left to
    judge by: the data then call for a diagnosis, since another effect may be missing, or these may be the wrong ones.
    """
    split = split_trials(system.trials, system.spare(), system.test())
    if not (split.fit and split.judging):
        return None
    case = Case(system, split, POLICY, seed)
    on_progress("fitting the known effects to more data" if effects else "fitting the base model to more data")
    candidate = case.sharpen(case.judge(case.fit_from(tuple(effects), values)))
    if not case.suffices(candidate):
        return None
    on_progress("estimating how well the parameters are known")
    return case.settled(candidate)
