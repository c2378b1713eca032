"""Waits in real time."""

import time
from collections.abc import Callable
from typing import TypeVar

PATIENCE_S = 60  # other tests may keep the computer busy

Value = TypeVar("Value")


def until(condition: Callable[[], Value], within_s: float = PATIENCE_S) -> Value:
    """Poll `condition()` until it is neither None nor False, or time is up; return its last value."""
    deadline = time.monotonic() + within_s
    while (value := condition()) is None or value is False:
        if time.monotonic() > deadline:
            break
        time.sleep(0.01)
    return value
