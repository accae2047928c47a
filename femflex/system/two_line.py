"""Two-line elements, propagated by SGP4.

Their elements are mean ones, of SGP4's own theory: they are never taken as those of an ellipse. SGP4 gives position and
velocity in TEME axes (true equator, mean equinox of date), and these are followed or started from.
"""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.extras import require
from femflex.system.ccsds import Ephemeris
from femflex.system.environment import J2000

J2000_JD = 2451545.0


def two_line_record(path: Path) -> Any:
    """The satellite record of sgp4 of a file of two lines, or of a name and two lines.

    Raises MissingExtra without sgp4, ValueError for other files and for a wrong check sum.
    """
    require("orbits", "two-line elements")
    from sgp4.api import Satrec
    from sgp4.io import verify_checksum

    lines = [line.rstrip() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    pair = [line for line in lines if line[:2] in ("1 ", "2 ")]
    if len(pair) != 2 or pair[0][0] != "1":
        raise ValueError(
            f"{path.name} has {len(pair)} lines of elements; give one set, with or without a name above it"
        )
    try:
        verify_checksum(*pair)
        return Satrec.twoline2rv(*pair)
    except (ValueError, IndexError) as error:
        raise ValueError(f"{path.name}: {error}") from None


def epoch_of(record: Any) -> float:
    """Days since J2000 of the epoch of the elements."""
    return float(record.jdsatepoch - J2000_JD + record.jdsatepochF)


def two_line_ephemeris(record: Any, days: Array) -> Ephemeris:
    """Positions [m] and velocities [m/s] at days (n,) since J2000, in TEME axes.

    Raises ValueError where SGP4 gives none, such as after decay.
    """
    from sgp4.api import SGP4_ERRORS

    whole = np.floor(days)
    errors, r, v = record.sgp4_array(J2000_JD + whole, days - whole)
    if errors.any():
        k = int(np.argmax(errors > 0))
        when = (J2000 + timedelta(days=float(days[k]))).isoformat(timespec="seconds")
        raise ValueError(f"SGP4 has no state at {when}: {SGP4_ERRORS[int(errors[k])]}")
    return Ephemeris(days, 1e3 * np.hstack([r, v]), "TEME")
