"""The Uno of the virtual bench."""

import pytest

from bifa.link import Uno


@pytest.fixture
def uno(rig):
    """The bench's Uno, connected."""
    with Uno(rig.transport, rig.clock, seed=1) as uno:
        uno.connect()
        yield uno
