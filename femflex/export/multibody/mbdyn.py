"""Modal data files of MBDyn (.fem), as its modal joint reads them.

After MBDyn's input manual, "Modal joint", and its reader (mbdyn/struct/modal.cc). Nodes are the markers of the body,
without mass, and point masses that have all of its mass moments (`lumped_masses`). MBDyn computes its inertia
invariants from them. Record group 13, the modal damping matrix, is ignored by older versions.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.body.marker import Marker
from femflex.body.moments import MassPoints
from femflex.body.strain import StrainTensors
from femflex.export.multibody.lumped import linear_body, lumped_masses, moments_of
from femflex.reading import reading
from femflex.writing import atomic_file

TITLES = {
    2: "FINITE ELEMENT NODE LIST", 3: "INITIAL MODAL DISPLACEMENTS", 4: "INITIAL MODAL VELOCITIES",
    5: "NODAL X COORDINATES", 6: "NODAL Y COORDINATES", 7: "NODAL Z COORDINATES", 8: "NON-RIGID MODE SHAPES",
    9: "MODAL MASS MATRIX", 10: "MODAL STIFFNESS MATRIX", 11: "DIAGONAL OF LUMPED MASS MATRIX",
    13: "MODAL DAMPING MATRIX",
}  # fmt: skip


def write_mbdyn(body: FlexibleBody, path: str | Path, name: str = "body", force: bool = False) -> list[str]:
    """Write a body as modal data of MBDyn. Returns what is worth saying, as lines.

    Nodes 1, 2 ... are its markers, in the order of `body.markers`; their axes are those of the body. Raises ValueError
    for a rigid body, and OSError.
    """
    body, said = linear_body(body, name)
    markers, masses, n = list(body.markers.values()), lumped_masses(body.moments), body.n_modes
    rho = np.concatenate([[marker.position for marker in markers], masses.rho])
    phi = np.concatenate([[marker.phi for marker in markers], masses.phi])  # node, axis, mode
    psi = np.concatenate([[marker.psi for marker in markers], np.zeros_like(masses.phi)])
    mass = np.concatenate([np.zeros(len(markers)), masses.dm])
    lumped = np.outer(mass, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    shapes = np.concatenate([phi, psi], axis=1)
    groups: dict[int, list[str]] = {
        2: [" ".join(str(k + 1) for k in range(len(rho)))],
        3: ["0 " * n], 4: ["0 " * n],
        **{5 + axis: _rows(rho[:, axis, None]) for axis in range(3)},
        8: [line for k in range(n) for line in (f"**    MODE {k + 1}", *_rows(shapes[:, :, k]))],
        9: _rows(body.moments.elastic_mass()), 10: _rows(body.strain.V1), 11: _rows(lumped), 13: _rows(body.damping),
    }  # fmt: skip
    lines = [f"** MBDyn modal data of {name}, in SI, by femflex"]
    lines += [f"** node {k + 1}: marker {marker}" for k, marker in enumerate(body.markers)]
    lines += ["**", "** RECORD GROUP 1, HEADER", "**   REVISION, NODES, NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES"]
    lines += [f"REV0 {len(rho)} {n} 0 0 0"]
    for number, rows in groups.items():
        lines += ["**", f"** RECORD GROUP {number}, {TITLES[number]}", *rows]
    with atomic_file(path, force) as part:
        part.write_text("\n".join([*lines, "**", ""]), encoding="utf-8")
    names = ", ".join(f"{k + 1} {marker}" for k, marker in enumerate(body.markers))
    note = "set `use invariant 9` in the modal joint for inertia of second order in the modes"
    return [f"MBDyn modal data, {body.moments.mass:.6g} kg, {n} modes, nodes {names}", note, *said]


def read_mbdyn(path: str | Path, names: Sequence[str] = ()) -> FlexibleBody:
    """The body of modal data with lumped masses; markers are the nodes without mass, "node_1" or as named.

    Raises ValueError for a file without group 11, with rotary inertia at nodes, or for another number of names.
    """
    path = Path(path)
    with reading(path, "MBDyn modal data file", "Write it again."):
        groups = _groups(path)
        _, n_nodes, n, *_ = groups[1].split()
        shape = (int(n), int(n_nodes), 6)
        shapes = _numbers(groups[8]).reshape(shape).transpose(1, 2, 0)
        rho = np.column_stack([_numbers(groups[5 + axis]) for axis in range(3)])
        M, K = (_numbers(groups[number]).reshape(int(n), -1) for number in (9, 10))
        D = _numbers(groups[13]).reshape(int(n), -1) if 13 in groups else np.zeros_like(M)
    if 11 not in groups:
        raise ValueError(f"{path.name} has no masses of nodes (record group 11), from which its inertia follows")
    lumped = _numbers(groups[11]).reshape(-1, 6)
    if lumped[:, 3:].any():
        raise ValueError(f"{path.name} has rotary inertia at nodes, which the mass moments of a body do not hold")
    heavy = lumped[:, 0] > 0.0
    moments = moments_of(MassPoints(lumped[heavy, 0], rho[heavy], shapes[heavy, :3]))
    difference = np.abs(moments.elastic_mass() - M).max() / np.abs(M).max()
    if difference > 1e-6:
        raise ValueError(
            f"the masses of nodes of {path.name} give another modal mass than its record group 9 (difference "
            f"{difference:.1e} of the largest entry, limit 1e-6)"
        )
    light = np.flatnonzero(~heavy)
    labels = names or [f"node_{groups[2].split()[k]}" for k in light]
    if len(labels) != len(light):
        raise ValueError(f"{path.name} has {len(light)} nodes without mass and {len(labels)} names were given")
    markers = {
        label: Marker(rho[k], shapes[k, :3], shapes[k, 3:], np.eye(3)) for label, k in zip(labels, light, strict=True)
    }
    return FlexibleBody(moments, StrainTensors.linear(K), D, markers)


def _rows(values: Array) -> list[str]:
    return [" ".join(repr(float(value)) for value in row) for row in values]


def _numbers(text: str) -> Array:
    return np.array(text.split(), float)


def _groups(path: Path) -> dict[int, str]:
    """Record group -> its numbers, without comments."""
    groups: dict[int, str] = {}
    number = 0
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("** RECORD GROUP"):
            number = int(line.split(",")[0].split()[-1])
            groups[number] = ""
        elif not line.startswith("**") and number:
            groups[number] += f"{line}\n"
    return groups
