"""Walks with a reversed displacement: a filling body gets longer, whichever way the robot moves.

The net displacement proves nothing, since a robot may slide back. The body's length (or, if only the head was tracked,
its position) must follow the body's command over whole cycles. As a slide or a late valve can reverse even that, the
pressure's bump at each snap-through decides, which they cannot reverse.
"""

from collections.abc import Iterator
from dataclasses import replace

from bifa.check.finding import Finding
from bifa.check.lag import displacement_lag, length_mm
from bifa.data import Trial

from .swing import follow, swing

_TAIL = "displacement_tail_mm"
_SHORTER_MM = 5.0  # shortening while the body is filled; healthy, tail tracked, cycles over 1.5 s: 1 to 60 mm longer
# Share of its range by which the body's pressure follows its command; less in cycles so fast that its snap-throughs
# come too late.
_FOLLOWS = 0.6


def shortens_mm(trial: Trial) -> float:
    """Return by how much the body gets shorter (if the tail is not tracked: the head moves back) while it is commanded
    to fill; 0 if negligible."""
    mm = swing(trial.columns["command_body"], length_mm(trial), trial.time_s)
    return -mm if mm is not None and mm < -_SHORTER_MM else 0.0


def check_mirror(trial: Trial) -> Iterator[Finding]:
    """Yield a finding for a walk whose length shrinks while the body is filled. Without any snap-through, a walk is
    judged only if the tail was tracked too."""
    mm = shortens_mm(trial)
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
    as_it_is, other_way = _snaps(trial), _snaps(replace(trial, columns=columns | mirrored))
    if as_it_is or other_way:
        return other_way > as_it_is
    share = follow(columns["command_body"], columns["pressure_body_psi"], trial.time_s)
    return _TAIL in columns and share is not None and abs(share) > _FOLLOWS


def _snaps(trial: Trial) -> int:
    """Number of snap-throughs whose bump in the pressure is explained by the displacement's speed."""
    lag = displacement_lag(trial)
    return 0 if lag is None else lag.snaps
