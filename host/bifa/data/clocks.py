"""Times as instruments write them, in seconds since the first one: dates, with or without time zones, and counted
frames."""

from collections.abc import Sequence
from datetime import UTC, datetime
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import numpy as np

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
FRAME, DATE = "frame", "date"


def zone_of(name: str) -> ZoneInfo:
    """The zone of this name; ValueError where there is none."""
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, OSError) as error:
        raise ValueError(f"unknown time zone {name!r}: write it as Europe/Berlin, or UTC") from error


def first_that_is_none(cells: Sequence[str], form: str | None, zone: ZoneInfo | None) -> int | None:
    """The first cell that is not a date in the declared form."""
    for row, cell in enumerate(cells):
        try:
            _moment(cell, form, zone)
        except ValueError:
            return row
    return None


def dated(cells: Sequence[str], form: str | None, zone: ZoneInfo | None) -> np.ndarray:
    """Seconds since the first date, shape (n,). `form`: as for strptime, None for ISO 8601; `zone`: of dates that name
    none; without one they are taken as those of UTC, so that no change of the clocks is seen."""
    moments = [_moment(cell, form, zone) for cell in cells]
    return np.array([(moment - moments[0]).total_seconds() for moment in moments])


def _moment(cell: str, form: str | None, zone: ZoneInfo | None) -> datetime:
    text = cell.strip()
    moment = datetime.fromisoformat(text) if form is None else datetime.strptime(text, form)
    return (moment if moment.tzinfo else moment.replace(tzinfo=zone or UTC)).astimezone(UTC)
