"""Mistakes in walks. Exchanged chambers come first, since they would make everything else seem wrong.

Each chamber's pressure follows its own command, unless chambers are exchanged or a sign is reversed.
"""

from collections.abc import Iterator, Sequence
from itertools import permutations

import numpy as np

from bifa.check.finding import Finding
from bifa.data import Trial
from bifa.robot.cpg import CHAMBERS

from .mirror import check_mirror, shortens_mm
from .schedule import check_gait, differing_parameters, estimate_gait
from .signs import MAX_REVERSED_SHARE, PORTS
from .swing import follow, swing

# Share of a pressure's range. In cycles of 3 s and more it follows its own command over 0.62 to 0.98 of it, even if
# valves choke; in faster ones over less, which proves nothing.
_MIN_FOLLOW_SHARE = 0.5
# Gain over following its own command. In healthy walks every exchange makes one of the chambers worse by 0.24 or more.
_MIN_GAIN = 0.04

Exchange = dict[str, str]  # chamber -> chamber whose command its pressure follows


def check_walk(trial: Trial, walks: Sequence[Trial] = ()) -> Iterator[Finding]:
    """Yield the mistakes in a walk. `walks`: the day's other walks, whose gait this may be."""
    shares = _following(trial)
    all_against = bool((np.diag(shares) < MAX_REVERSED_SHARE).all())
    if all_against and shortens_mm(trial):
        text = (
            "while they are 1, the pressures fall and the body gets shorter: 1 is positive pressure, 0 vacuum; "
            "exchange them in all three columns"
        )
        yield Finding("sign", text, trial.file, column="command_body")
    elif not all_against and (exchange := _find_exchange(shares)):
        yield _exchange_finding(trial, exchange, shares)
    else:
        yield from _check_reversed(trial, shares)
        yield from check_mirror(trial)
        yield from check_gait(trial, walks)


def _following(trial: Trial) -> np.ndarray:
    """Shares of its range by which the pressure of each chamber (row) follows the command of each (column), shape
    (3, 3) in the order of CHAMBERS; NaN where one of the two never changes."""
    shares = np.full((3, 3), np.nan)
    for i, pressure in enumerate(CHAMBERS):
        for j, command in enumerate(CHAMBERS):
            share = follow(trial.columns[f"command_{command}"], trial.columns[f"pressure_{pressure}_psi"], trial.time_s)
            shares[i, j] = np.nan if share is None else share
    return shares


def _find_exchange(shares: np.ndarray) -> Exchange:
    """The chambers whose pressures follow one another's commands far better than their own; empty if none."""
    best, most = {}, 0.0
    for order in permutations(range(3)):
        moved = [i for i in range(3) if order[i] != i]
        gains = [shares[i, order[i]] - shares[i, i] for i in moved]
        follows = all(
            shares[i, order[i]] > _MIN_FOLLOW_SHARE and gain > _MIN_GAIN for i, gain in zip(moved, gains, strict=True)
        )
        if moved and follows and min(gains) > most:
            best, most = {CHAMBERS[i]: CHAMBERS[order[i]] for i in moved}, min(gains)
    return best


def _exchange_finding(trial: Trial, exchange: Exchange, shares: np.ndarray) -> Finding:
    """Finding that describes what was exchanged: the commands' columns if the gait implies it, otherwise something
    about the pressures."""
    chamber, followed = next(iter(exchange.items()))
    row = shares[CHAMBERS.index(chamber)]
    seen = (
        f"follows command_{followed} (over {_percent(row, followed)} % of its range, and "
        f"command_{chamber} over {_percent(row, chamber)} %)"
    )
    names = " and ".join(exchange)
    renamed = {f"command_{c}": trial.columns[f"command_{exchange.get(c, c)}"] for c in CHAMBERS}
    if _matches_gait(trial, trial.columns) or not _matches_gait(trial, renamed):
        what = f"pressure columns, sensors or tubes of {names} are exchanged: trace the tubes, or rename the columns"
    else:
        what = f"the command columns of {names} are exchanged, as the gait confirms: rename them"
    return Finding("swapped", f"{seen}: {what}", trial.file, column=f"pressure_{chamber}_psi")


def _check_reversed(trial: Trial, shares: np.ndarray) -> Iterator[Finding]:
    """A finding for pressures that fall while their own command is positive."""
    chambers = [CHAMBERS[i] for i in np.flatnonzero(np.diag(shares) < MAX_REVERSED_SHARE)]
    if chambers:
        names = [f"pressure_{chamber}_psi" for chamber in chambers]
        falls = [
            -(swing(trial.columns[f"command_{chamber}"], trial.columns[name], trial.time_s) or 0.0)
            for chamber, name in zip(chambers, names, strict=True)
        ]
        listed = ", ".join(f"{psi:.2f}" for psi in falls)
        text = f"falls by {listed} psi while the chamber's command is positive, {PORTS}"
        yield Finding("sign", text, trial.file, column=", ".join(names))


def _percent(row: np.ndarray, chamber: str) -> str:
    return f"{100 * row[CHAMBERS.index(chamber)]:.0f}"


def _matches_gait(trial: Trial, commands: dict[str, np.ndarray]) -> bool:
    return not differing_parameters(trial.walked, estimate_gait(trial, commands))
