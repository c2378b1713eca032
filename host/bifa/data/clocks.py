"""Times as instruments write them: in units of time, as dates with or without time zones, as counted frames."""

from datetime import UTC, datetime
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
FRAME, DATE = "frame", "date"


def zone_of(name: str) -> ZoneInfo:
    """The zone of this name; ValueError where there is none."""
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, OSError) as error:
        raise ValueError(f"unknown time zone {name!r}: write it as Europe/Berlin, or UTC") from error


def moment_of(cell: str, form: str | None, zone: ZoneInfo | None) -> datetime:
    """The date in a cell; ValueError where there is none. `form`: as for strptime, None for ISO 8601; `zone`: of dates
    that name none; without one they are taken as those of UTC, so that no change of the clocks is seen."""
    text = cell.strip()
    moment = datetime.fromisoformat(text) if form is None else datetime.strptime(text, form)
    return (moment if moment.tzinfo else moment.replace(tzinfo=zone or UTC)).astimezone(UTC)
