"""Checks that reject misleading input before the search, naming the trial and the channel."""

from lacuna.check.given import check_names, check_records, coarse_clocks, gaps_in_inputs, other_clocks
from lacuna.check.model import check_model
from lacuna.check.repeats import check_inputs, check_times, not_declared, odd_ones, unexplained_differences
from lacuna.system import System


def check(system: System) -> tuple[str, ...]:
    """Raise MisuseError if the system cannot be diagnosed; return warnings. Simulates every trial a few times."""
    trials = tuple(system.trials)
    check_names(system, trials)
    check_records(trials)
    check_times(trials)
    predictions, said = check_model(system, trials)
    ignored = check_inputs(system, trials, predictions)
    odd = tuple(odd_ones(trials)) or tuple(unexplained_differences(system, trials))
    clocks = (*other_clocks(trials), *coarse_clocks(system, trials))
    return (*odd, *not_declared(trials), *clocks, *gaps_in_inputs(trials), *ignored, *said)
