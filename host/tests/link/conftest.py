"""An Uno behind a serial port, and a gait for it."""

import pytest

from harness.pty_uno import PtyUno


@pytest.fixture
def uno():
    uno = PtyUno()
    yield uno
    uno.unplug()


@pytest.fixture
def gait(tmp_path) -> str:
    """The path of a gait file."""
    path = tmp_path / "gait.toml"
    path.write_text(
        "period_s = 2\npsi12_deg = 270\npsi13_deg = 90\nduty_body = 0.5\nduty_head = 0.5\nduty_tail = 0.5\n"
    )
    return str(path)
