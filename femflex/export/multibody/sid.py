"""SID files: standard input data of a flexible body for multibody programs, such as SIMPACK's .SID_FEM.

After O. Wallrapp, "Standardization of flexible body modeling in multibody system codes, Part I: Definition of standard
input data", Mech. Struct. Mach. 22 (1994) 283-304; formulas as in R. Schwertassek and O. Wallrapp, "Dynamik flexibler
Mehrkörpersysteme" (1999), table 6.9. With r the place and phi_k the shapes, integrals over the mass:

    mdCM  int r, int phi_k                  J     -int r~ r~, -int (r~ phi_k~ + phi_k~ r~)
    Ct    int phi_k^T                       Cr    int (r x phi_k)^T, int (phi_l x phi_k)^T
    Me    int phi_k.phi_l                   Gr    -2 int r~ phi_k~, -2 int phi_l~ phi_k~
    Ge    2 int (phi_k x phi_l)^T           Oe    of phi_l.(omega~ omega~ r), for xx, yy, zz, xy, yz, zx

Terms of the geometric stiffness are zero. Gr is written to first order, so that the file holds every mass moment.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.body import FlexibleBody, MassMoments
from femflex.body.marker import Marker
from femflex.body.strain import StrainTensors
from femflex.export.multibody.lumped import linear_body, skew
from femflex.reading import reading
from femflex.writing import atomic_file

FULL, SYMMETRIC = 3, 2  # structures of a matrix
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))  # of the components of omega, as Oe has them
ENTRY = re.compile(r"m([01])\s*\(([\d\s,]+)\)")


def write_sid(body: FlexibleBody, path: str | Path, name: str = "body", force: bool = False) -> list[str]:
    """Write a body as a SID file. Returns what is worth saying, as lines.

    Nodes are its markers, in the order of `body.markers`. Raises ValueError for a rigid body, and OSError.
    """
    body, said = linear_body(body, name)
    n = body.n_modes
    lines = [f"{len(body.markers)} {n}", "part", "    new modal", *_refmod(body), "        frame"]
    for number, marker in enumerate(body.markers.values()):
        axes = skew(marker.psi.T) @ marker.orientation
        lines += [f"            new node = {number + 1}", "                rframe = body ref"]
        lines += _taylor("origin", marker.position[:, None], marker.phi[:, None, :], n)
        lines += _taylor("phi", marker.phi, None, n) + _taylor("psi", marker.psi, None, n)
        lines += _taylor("AP", marker.orientation, np.moveaxis(axes, 0, 2), n)
        lines += ["            end node"]
    lines += ["        end frame"]
    for key, (m0, m1, structure) in _terms(body).items():
        lines += _taylor(key, m0, m1, n, structure)
    with atomic_file(path, force) as part:
        part.write_text("\n".join([*lines, "    end modal", "end part", ""]), encoding="utf-8")
    names = ", ".join(f"{k + 1} {marker}" for k, marker in enumerate(body.markers))
    return [f"SID, {body.moments.mass:.6g} kg, {n} modes, nodes {names}", *said]


def read_sid(path: str | Path, names: Sequence[str] = ()) -> FlexibleBody:
    """The body of a SID file, with linear strain; names: of its nodes as markers, in place of "node_1".

    Raises ValueError for a file without Gr to first order, which alone holds all mass moments.
    """
    path = Path(path)
    with reading(path, "SID file", "Write it again as text, with one entry in a line."):
        data = _parsed(path)
        n = int(data["refmod"]["nelastq"])
        terms = data["terms"]
    if "Gr" not in terms or terms["Gr"][1] is None:
        raise ValueError(
            f"{path.name} has Gr to zeroth order, from which products of shapes do not follow; write Gr to first order"
        )
    if names and len(names) != len(data["nodes"]):
        raise ValueError(f"{path.name} has {len(data['nodes'])} nodes and {len(names)} names were given; give as many")
    first, second = np.zeros((1 + n, 3)), np.zeros((1 + n, 3, 1 + n, 3))
    first[0], first[1:] = terms["mdCM"][0][:, 0], terms["Ct"][0]
    J, (Gr, products) = terms["J"][0], terms["Gr"]
    second[0, :, 0] = np.trace(J) / 2 * np.eye(3) - J
    for k in range(n):
        second[1 + k, :, 0] = _dyad(-Gr[:, 3 * k : 3 * k + 3] / 2)
        second[0, :, 1 + k] = second[1 + k, :, 0].T
        for l in range(n):
            second[1 + k, :, 1 + l] = _dyad(-products[:, 3 * k : 3 * k + 3, l] / 2)
    markers = {}
    for k, (number, node) in enumerate(data["nodes"].items()):
        marker = Marker(node["origin"][0][:, 0], node["phi"][0], node["psi"][0], node["AP"][0])
        markers[names[k] if names else f"node_{number}"] = marker
    strain = StrainTensors(terms["Ke"][0], terms["ksigma"][0][:, 0])
    return FlexibleBody(MassMoments(float(data["refmod"]["mass"]), first, second), strain, terms["De"][0], markers)


def _dyad(product: Array) -> Array:
    """int b a^T (3, 3) from int a~ b~ = int b a^T - (a.b) 1."""
    return np.asarray(product - np.trace(product) / 2 * np.eye(3))


def _refmod(body: FlexibleBody) -> list[str]:
    """Mass, and the names of the shapes."""
    lines = [
        "        refmod",
        f"            mass = {float(body.moments.mass)!r}",
        f"            nelastq = {body.n_modes}",
    ]
    for k in range(body.n_modes):
        omega = body.omega[k] if k < len(body.omega) else np.nan
        kind = body.kinds[k] if body.kinds else "mode"
        text = f"Eigen Mode {k + 1} : {omega / (2 * np.pi):.9g} Hz" if np.isfinite(omega) else f"{kind} {k + 1}"
        lines.append(f"            ielastq ({k + 1}) = {text}")
    return [*lines, "        end refmod"]


def _terms(body: FlexibleBody) -> dict[str, tuple[Array, Array | None, int]]:
    """Every term by name: m0 (rows, columns), m1 (rows, columns, n) or None, and structure."""
    n, moments = body.n_modes, body.moments
    Q = moments.second
    with_place, among = Q[1:, :, 0], np.einsum("kalb->klab", Q[1:, :, 1:])  # int phi_k r^T, int phi_k phi_l^T
    turn = np.einsum("abc,lkbc->kal", _levi_civita(), among)  # int phi_l x phi_k
    cross = np.einsum("abc,kcb->ka", _levi_civita(), with_place)  # int r x phi_k
    C4 = with_place - np.einsum("kaa->k", with_place)[:, None, None] * np.eye(3)  # int r~ phi_k~
    C6 = among - np.einsum("klaa->kl", among)[:, :, None, None] * np.eye(3)  # int phi_l~ phi_k~
    Gr1 = np.moveaxis(-2 * C6, 1, 3).swapaxes(0, 1).reshape(3, 3 * n, n)
    Ge = 2 * np.einsum("lak->lka", turn).reshape(n, 3 * n)
    Oe = np.stack([C4[:, a, b] if a == b else C4[:, a, b] + C4[:, b, a] for a, b in PAIRS], axis=1)
    Oe1 = np.stack([C6[:, :, a, b] if a == b else C6[:, :, a, b] + C6[:, :, b, a] for a, b in PAIRS], axis=1)
    J1 = np.moveaxis(-C4 - C4.swapaxes(1, 2), 0, 2)
    return {
        "mdCM": (moments.first[0][:, None], moments.first[1:].T[:, None, :], FULL),
        "J": (moments.inertia(), J1, SYMMETRIC),
        "Ct": (moments.first[1:], None, FULL),
        "Cr": (cross, turn, FULL),
        "Me": (moments.elastic_mass(), None, SYMMETRIC),
        "Gr": (np.moveaxis(-2 * C4, 0, 1).reshape(3, 3 * n), Gr1, FULL),
        "Ge": (Ge, None, FULL),
        "Oe": (Oe, Oe1, FULL),
        "ksigma": (body.strain.f0[:, None], None, FULL),
        "Ke": (body.strain.V1, None, SYMMETRIC),
        "De": (body.damping, None, FULL),
    }


def _levi_civita() -> Array:
    e = np.zeros((3, 3, 3))
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        e[a, b, c], e[a, c, b] = 1.0, -1.0
    return e


def _taylor(name: str, m0: Array, m1: Array | None, n: int, structure: int = FULL) -> list[str]:
    """A matrix with its derivatives by the n modal coordinates."""
    rows, columns = m0.shape
    header = {"order": int(m1 is not None), "nrow": rows, "ncol": columns, "nq": n, "nqn": 0, "structure": structure}
    lines = [f"        {name}", *(f"            {key} = {value}" for key, value in header.items())]
    for i in range(rows):
        lines += [
            f"            m0({i + 1},{j + 1}) = {float(m0[i, j])!r}"
            for j in range(i + 1 if structure == SYMMETRIC else columns)
        ]
    if m1 is not None:
        lines += [
            f"            m1({i + 1},{j + 1},{k + 1}) = {float(m1[i, j, k])!r}" for i, j, k in np.ndindex(m1.shape)
        ]
    return [*lines, f"        end {name}"]


def _parsed(path: Path) -> dict[str, Any]:
    """refmod: name -> value; nodes: number -> terms; terms: name -> (m0, m1 or None)."""
    lines = iter([line.strip() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()])
    data: dict[str, Any] = {"refmod": {}, "nodes": {}, "terms": {}}
    target = data["terms"]
    for line in lines:
        key, _, value = (text.strip() for text in line.partition("="))
        if key == "refmod":
            data["refmod"] = dict(_entries_until(lines, "end refmod"))
        elif key == "new node":
            target = data["nodes"].setdefault(value, {})
        elif key in ("end node", "end frame"):
            target = data["terms"]
        elif not value and key[0].isalpha() and not key.startswith(("part", "new ", "frame", "end ")):
            target[key] = _matrix(dict(_entries_until(lines, f"end {key}")))
    return data


def _entries_until(lines: Iterator[str], end: str) -> Iterator[tuple[str, str]]:
    """Keys and values of the lines up to one. Raises ValueError where it does not come."""
    for line in lines:
        if line == end:
            return
        key, _, value = line.partition("=")
        yield key.strip(), value.strip()
    raise ValueError(f"the file ends before {end!r}")


def _matrix(entries: dict[str, str]) -> tuple[Array, Array | None]:
    rows, columns, n = (int(entries[key]) for key in ("nrow", "ncol", "nq"))
    structure, order = int(entries.get("structure", FULL)), int(entries.get("order", 0))
    m0 = np.eye(rows) if structure == 4 else np.zeros((rows, columns))
    m1 = np.zeros((rows, columns, n)) if order else None
    for key, value in entries.items():
        if (match := ENTRY.fullmatch(key)) is None:
            continue
        index = tuple(int(k) - 1 for k in match[2].split(","))
        if match[1] == "1":
            if m1 is not None:
                m1[index] = float(value)
        else:
            m0[index] = float(value)
            if structure == SYMMETRIC:
                m0[index[::-1]] = float(value)
    return m0, m1
