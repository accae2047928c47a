"""Times on the command line: a number of seconds, or a number with a unit."""

from __future__ import annotations

import re


def read_seconds(text: str | None, option: str) -> float | None:
    """A time [s] from "12.5" or "2 min"; None for None. Raises ValueError naming the option.

    >>> read_seconds("2 min", "--at")
    120.0
    """
    if text is None:
        return None
    if re.fullmatch(r"\s*[-+.\deE]+\s*", text):
        try:
            return float(text)
        except ValueError:
            pass
    from femflex.noun.units import UnitError, to_si

    try:
        return to_si(text, "s")
    except UnitError as error:
        raise ValueError(f"{option}: {error}") from None
