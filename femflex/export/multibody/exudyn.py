"""Reduced bodies of Exudyn: what its ObjectFFRFreducedOrderInterface reads with LoadFromFile.

After Exudyn's FEM.py, version 1.13. Nodes are the markers of the body and the points of its skin, which Exudyn draws.
The inertia terms come from the body's mass moments, so that the nodes carry no mass.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.body import FlexibleBody
from femflex.export.multibody.lumped import linear_body, skew
from femflex.writing import atomic_file


def write_exudyn(body: FlexibleBody, path: str | Path, name: str = "body", force: bool = False) -> list[str]:
    """Write a body as data of Exudyn (.npz). Returns what is worth saying, as lines.

    Nodes 0, 1 ... are its markers, in the order of `body.markers`. Raises ValueError for a rigid body, and OSError.
    """
    body, said = linear_body(body, name)
    moments, n, Q = body.moments, body.n_modes, body.moments.second
    rho = np.array([marker.position for marker in body.markers.values()])
    phi = np.array([marker.phi for marker in body.markers.values()])  # node, axis, mode
    triangles = np.zeros((0, 3), int)
    if body.skin is not None:
        quads = body.skin.cells.get("quad", np.zeros((0, 4), int))
        pieces = [body.skin.cells.get("triangle", triangles), quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
        triangles = np.concatenate(pieces) + len(rho)
        rho = np.concatenate([rho, body.skin.points])
        phi = np.concatenate([phi, body.skin.shapes[:n].transpose(1, 2, 0)])
    with_place, among = Q[1:, :, 0], np.einsum("kalb->klab", Q[1:, :, 1:])  # int phi_k r^T, int phi_k phi_l^T
    eye = np.eye(3)
    e = skew(eye)  # (e_a)~: b~ = sum_a b_a e[a]
    among_tilde = np.einsum("klab,axi,bxj->kilj", among, e, e).reshape(3 * n, 3 * n)  # int phi_k~^T phi_l~
    tilde_among = np.einsum("klab,abi->kil", among, e).reshape(3 * n, n)  # int phi_k~^T phi_l
    data = {
        "modeBasis": phi.reshape(-1, n),
        "trigList": triangles,
        "postProcessingModes": np.array({}, dtype=object),
        "massMatrixReduced": moments.elastic_mass(),
        "stiffnessMatrixReduced": body.strain.V1,
        "infoList": np.array([n, len(rho), 3, 4, 7, 7 + n]),
        "rigidBodyNodeType": "NodeType.RotationEulerParameters",
        "xRef": rho.ravel(),
        "inertiaLocal": moments.inertia(),
        "Mtt": moments.mass * eye,
        "totalMass": moments.mass,
        "chiU": moments.center_of_mass(),
        "chiUtilde": skew(moments.center_of_mass()),
        "mPsiTildePsi": tilde_among,
        "mPsiTildePsiTilde": among_tilde,
        "mPhitTPsi": moments.first[1:].T,
        "mPhitTPsiTilde": np.concatenate(list(skew(moments.first[1:])), axis=1),
        "mXRefTildePsi": np.einsum("kba,abi->ik", with_place, e),  # int r~^T phi_k
        "mXRefTildePsiTilde": np.einsum("kba,axi,bxj->ikj", with_place, e, e).reshape(3, 3 * n),  # int r~^T phi_k~
        "fileVersion": 1,
        "type": "ObjectFFRFreducedOrderInterface",
    }
    with atomic_file(path, force) as part:
        np.savez(part, **data)
    if body.damping.any():
        said.append("its damping is not part of Exudyn's file; set dampingMatrix of ObjectFFRFreducedOrder")
    names = ", ".join(f"{k} {marker}" for k, marker in enumerate(body.markers))
    return [f"Exudyn reduced body, {moments.mass:.6g} kg, {n} modes, nodes {names}", *said]
