"""Walks whose displacement runs the wrong way: a filling body gets longer, whichever way the robot goes.

The net displacement says nothing: a robot may slide back. Its length (or, where only the head was tracked, its
position) must follow the body's command over whole cycles. The bump in the pressure at each snap-through decides: a
slide or a late valve can reverse the former, not the latter.
"""

from collections.abc import Iterator
from dataclasses import replace

from bifa.check.finding import Finding
from bifa.check.lag import displacement_lag, length_mm
from bifa.data import Trial

from .swing import follow, swing

_TAIL = "displacement_tail_mm"
_SHORTER_MM = 5.0  # while the body is filled; healthy, tail tracked, cycles over 1.5 s: +1 to +60 mm
_FOLLOWS = 0.6  # of its range, the body's pressure its command; less in cycles so fast that its snaps come too late


def shortens_mm(trial: Trial) -> float:
    """By how much the body gets shorter while it is commanded to fill (tail not tracked: the head goes back); 0 if
    negligible."""
    mm = swing(trial.columns["command_body"], length_mm(trial), trial.time_s)
    return -mm if mm is not None and mm < -_SHORTER_MM else 0.0


def check_mirror(trial: Trial) -> Iterator[Finding]:
    """A walk whose length shrinks while the body is filled. Where nothing snaps only a length is judged."""
    mm = shortens_mm(trial)
    if not mm or not _is_turned(trial):
        return
    if _TAIL in trial.columns:
        text = (
            f"the body gets {mm:.1f} mm shorter (head minus tail) while it is filled, where it should get longer: "
            "does the camera's axis point backwards, or are head and tail exchanged? Reverse both signs, or rename the "
            "columns"
        )
    else:
        text = (
            f"the head goes back by {mm:.1f} mm while the body is filled, where it should go forward: does the "
            "camera's axis point backwards? Reverse the sign"
        )
    yield Finding("mirrored", text, trial.file, column="displacement_head_mm")


def _is_turned(trial: Trial) -> bool:
    columns = trial.columns
    turned = {name: -values for name, values in columns.items() if name.startswith("displacement")}
    as_it_is, other_way = _snaps(trial), _snaps(replace(trial, columns=columns | turned))
    if as_it_is or other_way:
        return other_way > as_it_is
    share = follow(columns["command_body"], columns["pressure_body_psi"], trial.time_s)
    return _TAIL in columns and share is not None and abs(share) > _FOLLOWS


def _snaps(trial: Trial) -> int:
    """Snap-throughs whose bump in the pressure the displacement's speed explains."""
    lag = displacement_lag(trial)
    return 0 if lag is None else lag.snaps
