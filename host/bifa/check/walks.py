"""What was mistaken in a walk: exchanged chambers first, since everything else would seem wrong with them."""

from collections.abc import Iterator, Sequence

import numpy as np

from bifa.check.finding import Finding
from bifa.data import Trial

from .chambers import exchange_finding, exchanged, following, turned
from .mirror import check_mirror, shortens_mm
from .schedule import check_gait
from .steps import AGAINST


def check_walk(trial: Trial, walks: Sequence[Trial] = ()) -> Iterator[Finding]:
    """`walks`: the day's others, whose gait this may be."""
    shares = following(trial)
    all_against = bool((np.diag(shares) < AGAINST).all())
    if all_against and shortens_mm(trial):
        text = (
            "while they are 1 the pressures fall and the body gets shorter: 1 is positive pressure, 0 vacuum; exchange "
            "them in all three columns"
        )
        yield Finding("sign", text, trial.file, column="command_body")
    elif not all_against and (exchange := exchanged(shares)):
        yield exchange_finding(trial, exchange, shares)
    else:
        yield from turned(trial, shares)
        yield from check_mirror(trial)
        yield from check_gait(trial, walks)
