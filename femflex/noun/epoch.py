"""Dates in cases: read as days since J2000."""

from __future__ import annotations

from datetime import UTC, date, datetime
from typing import Any

from femflex.noun.values import ValueProblem, _Readable, value_text

J2000 = datetime(2000, 1, 1, 12, tzinfo=UTC)


class EpochValue(_Readable):
    """A date and time in UTC, of TOML or as a text of ISO 8601. Reads into days since J2000 (2000-01-01, 12:00)."""

    def read_value(self, value: Any) -> float:
        """Days since J2000. A time without a zone is UTC."""
        if isinstance(value, str):
            try:
                value = datetime.fromisoformat(value)
            except ValueError:
                raise ValueProblem(
                    f"found {value!r}; expected a date and time in UTC, such as 2026-03-20T14:46:00Z"
                ) from None
        if isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        if isinstance(value, date) and not isinstance(value, datetime):
            value = datetime(value.year, value.month, value.day)
        if not isinstance(value, datetime):
            raise ValueProblem(
                f"found {value_text(value)}; expected a date and time in UTC, such as 2026-03-20T14:46:00Z"
            )
        value = value if value.tzinfo else value.replace(tzinfo=UTC)
        return (value - J2000).total_seconds() / 86400.0

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of a date and time."""
        return {"format": "date-time", "description": "date and time in UTC"}


def days_since_j2000(value: datetime | date | str) -> float:
    """Days since J2000 of a date and time in UTC. Raises ValueError for a text that is none."""
    return EpochValue().read_value(value)
