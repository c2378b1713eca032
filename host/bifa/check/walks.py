"""Mistakes in walks. Exchanged chambers come first, since they would make everything else seem wrong.

Each chamber's pressure follows its own command, unless chambers are exchanged or a sign is reversed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from bifa.check.finding import Finding
from bifa.check.lag import displacement_lag, length_mm
from bifa.data import Trial
from bifa.ranges import CHAMBERS

from .schedule import check_gait, differing_parameters, estimate_gait
from .signs import MAX_REVERSED_SHARE, PORTS, follow, swing

# Share of a pressure's range. In cycles of 3 s and more it follows its own command over 0.62 to 0.98 of it, even if
# valves choke; in faster ones over less, which proves nothing.
_MIN_FOLLOW_SHARE = 0.5
# Gain over following its own command. In healthy walks every exchange makes one of the chambers worse by 0.24 or more.
_MIN_GAIN = 0.04

_TAIL = "displacement_tail_mm"
_SHORTER_MM = 5.0  # shortening while the body is filled; healthy, tail tracked, cycles over 1.5 s: 1 to 60 mm longer
# Share of its range by which the body's pressure follows its command; less in cycles so fast that its snap-throughs
# come too late.
_FOLLOWS = 0.6

Exchange = dict[str, str]  # chamber -> chamber whose command its pressure follows


def check_walk(trial: Trial, walks: Sequence[Trial] = ()) -> Iterator[Finding]:
    """Yield the mistakes in a walk. `walks`: the day's other walks, whose gait this may be."""
    shares = _following(trial)
    all_against = bool((np.diag(shares) < MAX_REVERSED_SHARE).all())
    if all_against and _shortens_mm(trial):
        text = (
            "while they are 1, the pressures fall and the body gets shorter: 1 is positive pressure, 0 vacuum; "
            "exchange them in all three columns"
        )
        yield Finding("sign", text, trial.file, column="command_body")
    elif not all_against and (exchange := _find_exchange(shares)):
        yield _exchange_finding(trial, exchange, shares)
    else:
        yield from _check_reversed(trial, shares)
        yield from _check_mirror(trial)
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


def _shortens_mm(trial: Trial) -> float:
    """By how much the body gets shorter (if the tail is not tracked: the head moves back) while it is commanded to
    fill; 0 if negligible."""
    mm = swing(trial.columns["command_body"], length_mm(trial), trial.time_s)
    return -mm if mm is not None and mm < -_SHORTER_MM else 0.0


def _check_mirror(trial: Trial) -> Iterator[Finding]:
    """A finding for a walk whose length shrinks while the body is filled.

    The net displacement proves nothing, since a robot may slide back. As a slide or a late valve can reverse even the
    length, the pressure's bump at each snap-through decides, which they cannot reverse. Without any snap-through, a
    walk is judged only if the tail was tracked too.
    """
    mm = _shortens_mm(trial)
    if not mm or not _is_mirrored(trial):
        return
    if _TAIL in trial.columns:
        text = (
            f"the body gets {mm:.1f} mm shorter (head minus tail) while it is filled, but should get longer: does the "
            "camera's axis point backwards, or are head and tail exchanged? Reverse both signs, or rename the columns"
        )
    else:
        text = (
            f"the head moves back by {mm:.1f} mm while the body is filled, but should move forward: does the "
            "camera's axis point backwards? Reverse the sign"
        )
    yield Finding("mirrored", text, trial.file, column="displacement_head_mm")


def _is_mirrored(trial: Trial) -> bool:
    columns = trial.columns
    mirrored = {name: -values for name, values in columns.items() if name.startswith("displacement")}
    # how many snap-throughs the displacement's speed explains, either way
    lags = displacement_lag(trial), displacement_lag(replace(trial, columns=columns | mirrored))
    as_it_is, other_way = (0 if lag is None else lag.snaps for lag in lags)
    if as_it_is or other_way:
        return other_way > as_it_is
    share = follow(columns["command_body"], columns["pressure_body_psi"], trial.time_s)
    return _TAIL in columns and share is not None and abs(share) > _FOLLOWS
