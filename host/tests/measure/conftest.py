"""The virtual bench's Uno."""

import pytest

from bifa.link import Uno


@pytest.fixture
def uno(rig):
    """Connected."""
    with Uno(rig.transport, rig.clock, seed=1) as uno:
        uno.connect()
        yield uno
