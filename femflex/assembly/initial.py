"""Initial elastic coordinates from modal amplitudes or the displacement of a marker."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.case.initial import InitialTable

REACHED = 1e-6  # relative difference from the requested displacement within which it counts as reached


def initial_shape(table: InitialTable, body: FlexibleBody, joint_at: Array) -> tuple[Array, Array]:
    """Elastic coordinates and their rates (n,) at t = 0; joint_at (3,) is the position of its joint, body frame [m].

    A displacement is reached to first order by the shapes other than modal derivatives; the derivatives take the values
    of least strain energy.

    Raises ValueError if there are more amplitudes than modes, or if the modes cannot reach the displacement.
    """
    rates = _padded_amplitudes(table.rates or (), body.n_modes, "rates")
    if table.marker is None:
        return _padded_amplitudes(table.amplitudes or (), body.n_modes, "amplitudes"), rates
    return body.strain.settled(_displacing_coordinates(table, body, joint_at), _derivatives(body)), rates


def _derivatives(body: FlexibleBody) -> NDArray[np.intp]:
    """Numbers of the elastic coordinates that are modal derivatives."""
    return np.flatnonzero([kind == "derivative" for kind in body.kinds[: body.n_modes]])


def _displacing_coordinates(table: InitialTable, body: FlexibleBody, joint_at: Array) -> Array:
    """Elastic coordinates (n,) that give the marker of the table its displacement, to first order."""
    leading = np.setdiff1d(np.arange(body.n_modes), _derivatives(body))
    displacement, _ = requested_displacement(table, body, joint_at)
    phi = body.marker(str(table.marker)).phi[:, leading]
    delta = np.zeros(body.n_modes)
    if table.shape == "static":
        delta[leading] = _static_coordinates(
            body.strain.V1[np.ix_(leading, leading)], phi, displacement, str(table.marker)
        )
    else:
        delta[leading] = _least_amplitudes(phi, displacement, table)
    return delta


def requested_displacement(table: InitialTable, body: FlexibleBody, joint_at: Array) -> tuple[Array, float]:
    """The requested displacement (3,) of the table's marker [m, body axes], and the length it is relative to [m]."""
    marker = body.marker(str(table.marker))
    length = table.length or float(np.linalg.norm(marker.position - joint_at))
    along_marker = np.array(table.displacement) if table.relative is None else length * np.array(table.relative)
    return marker.orientation @ along_marker, length


def _padded_amplitudes(values: tuple[float, ...], n: int, key: str) -> Array:
    if len(values) > n:
        raise ValueError(f"found {len(values)} {key}; the body has {n} elastic coordinates")
    return np.concatenate([np.array(values, float), np.zeros(n - len(values))])


def _static_coordinates(stiffness: Array, phi: Array, displacement: Array, name: str) -> Array:
    """Coordinates (n,) under the static force that gives the marker of rows phi (3, n) this displacement."""
    compliance = np.linalg.solve(stiffness, phi.T)
    force = np.linalg.lstsq(phi @ compliance, displacement, rcond=1e-10)[0]
    delta = compliance @ force
    _check_reached(phi @ delta, displacement, name, "a static force there")
    return np.asarray(delta)


def _least_amplitudes(phi: Array, displacement: Array, table: InitialTable) -> Array:
    """The smallest amplitudes of the named modes, or of as few of the lowest as needed, for marker rows phi (3, n)."""
    n = phi.shape[1]
    if table.modes is not None and max(table.modes) > n:
        raise ValueError(f"found mode {max(table.modes)}; the body has {n}")
    sets = [[k - 1 for k in table.modes]] if table.modes is not None else [list(range(k)) for k in range(1, n + 1)]
    delta = np.zeros(n)
    for columns in sets:
        delta = np.zeros(n)
        delta[columns] = np.linalg.lstsq(phi[:, columns], displacement, rcond=1e-9)[0]
        if np.linalg.norm(phi @ delta - displacement) <= REACHED * np.linalg.norm(displacement):
            return delta
    _check_reached(phi @ delta, displacement, str(table.marker), f"its {len(sets[-1]) if sets else 0} modes")
    return delta


def _check_reached(reached: Array, requested: Array, name: str, means: str) -> None:
    if np.linalg.norm(reached - requested) > REACHED * np.linalg.norm(requested):
        raise ValueError(
            f"marker {name!r}: the requested initial displacement is {_metres_text(requested)} (body axes), and "
            f"{means} give at most {_metres_text(_without_rounding(reached, requested))}; give a displacement in a "
            "direction in which the body bends, or keep more modes"
        )


def _without_rounding(reached: Array, requested: Array) -> Array:
    """The reached displacement, with components that are only rounding set to zero."""
    return np.where(np.abs(reached) < 1e-9 * np.linalg.norm(requested), 0.0, reached)


def _metres_text(v: Array) -> str:
    return "[" + ", ".join(f"{x:.4g}" for x in v) + "] m"
