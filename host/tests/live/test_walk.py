"""Walking without a monitor: progress and the reason for its end are reported."""

import re

import pytest

from bifa.link import LinkError
from bifa.live.walk import walk


def test_time_cycle_and_pressures_are_told_while_it_walks(board, connected):
    said = []
    connected.set("period_s", 2.0)
    walk(connected, board, 5.0, said.append)
    assert re.fullmatch(
        r"walking: [01] of 5 s, cycle 1, psi: body [+-]\d+\.\d  head [+-]\d+\.\d  tail [+-]\d+\.\d", said[0]
    )
    assert said[-1].startswith("walking: 5 of 5 s, cycle 3, psi: body ")


@pytest.mark.parametrize(
    ("cause", "told"),
    [
        (lambda uno, board: uno.send_stop(), r"the robot stopped walking \(state: stopped"),
        (lambda uno, board: board.sleep(3.0), r"\(state: fault, fault: host_silent, 2 s, limit 2 s\)$"),
    ],
    ids=["a stop", "a fault"],
)
def test_what_ends_it_is_told_with_its_state_and_a_fault_with_its_value_and_limit(board, connected, cause, told):
    with pytest.raises(LinkError, match=told):
        walk(connected, board, 60.0, lambda said: cause(connected, board))
