"""Which trials are fitted, which choose between explanations, and which are used only for the final test."""

from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass

from lacuna.errors import MisuseError, TooLittleDataError, listed
from lacuna.system import Record, groups_of_repeats


@dataclass(frozen=True)
class Split:
    """`fit`: trials to fit. `select`: further repeats of the same conditions; `unseen`: repeats of whole conditions
    that are never fitted; both choose between explanations. `final`: repeats of either kind (without repeats: single
    trials) that inform no choice and serve as the test."""

    fit: tuple[Record, ...]
    select: tuple[Record, ...]
    unseen: tuple[Record, ...]
    final: tuple[Record, ...]

    @property
    def known(self) -> tuple[Record, ...]:
        """The trials that the final explanation is fitted to."""
        return self.fit + self.select

    @property
    def judging(self) -> tuple[Record, ...]:
        """The trials on which explanations are compared, besides the fitted ones."""
        return self.select + self.unseen

    @property
    def not_fitted(self) -> tuple[Record, ...]:
        """The trials that the final explanation is not fitted to, whether they informed a choice or not."""
        return self.unseen + self.final

    @property
    def conditions(self) -> tuple[Record, ...]:
        """The final trials of conditions that were never fitted."""
        fitted = {(t.experiment, t.condition) for t in self.known}
        return tuple(t for t in self.final if (t.experiment, t.condition) not in fitted)

    @property
    def repeats(self) -> tuple[Record, ...]:
        """The final trials of conditions with other repeats that were fitted."""
        names = {t.name for t in self.conditions}
        return tuple(t for t in self.final if t.name not in names)


def split_trials(
    trials: Sequence[Record], spare: Collection[tuple[str, Hashable]] = (), test: Collection[str] = ()
) -> Split:
    """Split by whole trials; deterministic. `test`: names of the trials to be `final`, if the user chooses them; those
    that would be `final` otherwise then go to `select`. Raises MisuseError if the others do not suffice to fit, to
    judge, or to estimate the noise.

    `spare`: (experiment, condition) pairs that are never fitted: the last repeat of each is `final`, the others are
    `unseen`. Of three or more repeats of any other condition a third goes to `final` and a third to `select`, rotating
    so that no part gets all the early or all the late runs of a session. Of two repeats one is fitted and the other
    goes to `final` and `select` in turn, of trials without repeats one in five to each. No trial is `final` if nothing
    else could judge, or if it is the only one with a channel.
    """
    parts: dict[str, list[Record]] = {"fit": [], "select": [], "unseen": [], "final": []}
    pairs = singles = 0
    for turn, members in enumerate(groups_of_repeats([t for t in trials if t.name not in test])):
        first = members[0]
        if (first.experiment, first.condition) in spare:
            most = max(len(members) - 1, 1)
            parts["unseen"] += members[:most]
            parts["final"] += members[most:]
        elif len(members) == 1:
            parts[("fit", "fit", "select", "fit", "final")[singles % 5]].append(first)
            singles += 1
        elif len(members) == 2:
            parts["fit"].append(members[pairs % 2])
            parts["select" if pairs % 2 else "final"].append(members[1 - pairs % 2])
            pairs += 1
        else:
            for place, trial in enumerate(members):
                parts[("final", "select", "fit")[(place + turn) % 3]].append(trial)
    if test:
        parts["select"] += parts["final"]
        parts["final"] = [t for t in trials if t.name in test]
        _check_test(**parts)
    else:
        known = {key for role in ("fit", "select", "unseen") for trial in parts[role] for key in _channels(trial)}
        alone = [trial for trial in parts["final"] if not _channels(trial) <= known]
        if not (parts["select"] or parts["unseen"] or alone):
            parts["select"], parts["final"] = parts["final"][:1], parts["final"][1:]
        for trial in alone:
            parts["final"].remove(trial)
            parts["fit"].append(trial)
    order = {trial.name: k for k, trial in enumerate(trials)}
    return Split(**{role: tuple(sorted(ts, key=lambda t: order[t.name])) for role, ts in parts.items()})


def _check_test(fit: list[Record], select: list[Record], unseen: list[Record], final: list[Record]) -> None:
    """The test informs nothing, so other trials are needed to fit, to judge, and to estimate its channels' noise."""
    if not fit or not (select or unseen):
        raise TooLittleDataError(
            f"test names {listed(t.name for t in final)}: none of the other records is left to"
            f" {'judge explanations' if fit else 'fit'}. Leave one of them out of the test, or measure more."
        )
    known = {channel for trial in (*fit, *select, *unseen) for channel in trial.channels}
    for trial in final:
        if alone := trial.channels.keys() - known:
            raise MisuseError(
                f"test names {trial.name}, but no other record has {listed(sorted(alone))}, which is needed to estimate"
                " its noise: leave it out of the test."
            )


def _channels(trial: Record) -> set[tuple[str, str]]:
    return {(trial.experiment, channel) for channel in trial.channels}
