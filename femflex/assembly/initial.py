"""Initial elastic coordinates from modal amplitudes or the displacement of a marker."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.case.initial import InitialTable

REACHED = 1e-6  # difference from the wanted displacement, relative, still taken as reached


def initial_shape(table: InitialTable, body: FlexibleBody, joint_at: Array) -> tuple[Array, Array]:
    """Elastic coordinates and their rates (n,) at t = 0; joint_at (3,) is where the body is held, body frame [m].

    A displacement is met to first order by shapes other than modal derivatives; these settle where they store least
    energy, as a body drawn aside by hand would.

    Raises ValueError when there are more amplitudes than modes, or the modes do not reach the displacement.
    """
    rates = _filled(table.rates or (), body.n_modes, "rates")
    if table.marker is None:
        return _filled(table.amplitudes or (), body.n_modes, "amplitudes"), rates
    return body.strain.settled(_displaced(table, body, joint_at), _derivatives(body)), rates


def _derivatives(body: FlexibleBody) -> NDArray[np.intp]:
    """Numbers of the elastic coordinates that are modal derivatives."""
    return np.flatnonzero([kind == "derivative" for kind in body.kinds[: body.n_modes]])


def _displaced(table: InitialTable, body: FlexibleBody, joint_at: Array) -> Array:
    """Elastic coordinates (n,) that displace the marker of the table as it says, to first order."""
    leading = np.setdiff1d(np.arange(body.n_modes), _derivatives(body))
    wanted, _ = wanted_displacement(table, body, joint_at)
    phi = body.marker(str(table.marker)).phi[:, leading]
    delta = np.zeros(body.n_modes)
    if table.shape == "static":
        delta[leading] = _static(body.strain.V1[np.ix_(leading, leading)], phi, wanted, str(table.marker))
    else:
        delta[leading] = _in_modes(phi, wanted, table)
    return delta


def wanted_displacement(table: InitialTable, body: FlexibleBody, joint_at: Array) -> tuple[Array, float]:
    """The displacement (3,) [m, body axes] that a table asks of its marker, and the length that it is relative to."""
    marker = body.marker(str(table.marker))
    length = table.length or float(np.linalg.norm(marker.position - joint_at))
    along_marker = np.array(table.displacement) if table.relative is None else length * np.array(table.relative)
    return marker.orientation @ along_marker, length


def _filled(values: tuple[float, ...], n: int, key: str) -> Array:
    if len(values) > n:
        raise ValueError(f"found {len(values)} {key}; the body has {n} elastic coordinates")
    return np.concatenate([np.array(values, float), np.zeros(n - len(values))])


def _static(stiffness: Array, phi: Array, wanted: Array, name: str) -> Array:
    """Coordinates (n,) under the static force that displaces the marker of rows phi (3, n) so: least strain energy."""
    compliance = np.linalg.solve(stiffness, phi.T)
    force = np.linalg.lstsq(phi @ compliance, wanted, rcond=1e-10)[0]
    delta = compliance @ force
    _check_reached(phi @ delta, wanted, name, "a static force there")
    return np.asarray(delta)


def _in_modes(phi: Array, wanted: Array, table: InitialTable) -> Array:
    """The smallest amplitudes of the named modes, or of as few of the lowest as needed, for marker rows phi (3, n)."""
    n = phi.shape[1]
    if table.modes is not None and max(table.modes) > n:
        raise ValueError(f"found mode {max(table.modes)}; the body has {n}")
    sets = [[k - 1 for k in table.modes]] if table.modes is not None else [list(range(k)) for k in range(1, n + 1)]
    delta = np.zeros(n)
    for columns in sets:
        delta = np.zeros(n)
        delta[columns] = np.linalg.lstsq(phi[:, columns], wanted, rcond=1e-9)[0]
        if np.linalg.norm(phi @ delta - wanted) <= REACHED * np.linalg.norm(wanted):
            return delta
    _check_reached(phi @ delta, wanted, str(table.marker), f"its {len(sets[-1]) if sets else 0} modes")
    return delta


def _check_reached(found: Array, wanted: Array, name: str, by: str) -> None:
    if np.linalg.norm(found - wanted) > REACHED * np.linalg.norm(wanted):
        raise ValueError(
            f"marker {name!r}: the requested initial displacement is {_metres(wanted)} (body axes), and {by} give at "
            f"most {_metres(_rounded(found, wanted))}; give a displacement in a direction in which the body bends, or "
            "keep more modes"
        )


def _rounded(found: Array, wanted: Array) -> Array:
    """Without components that are rounding compared with the requested ones."""
    return np.where(np.abs(found) < 1e-9 * np.linalg.norm(wanted), 0.0, found)


def _metres(v: Array) -> str:
    return "[" + ", ".join(f"{x:.4g}" for x in v) + "] m"
