"""Second-order displacement of the points of a beam's sections, which rotate along circles.

A point at offset o from the line moves by (exp(psi) - 1) o. With s_k = (theta, -w', v') of shape k in axes whose x axis
e lies along the beam, psi = s - 1/2 (e.s) e x s, so that to second order the displacement in addition to psi_k x o is

    1/2 delta_k delta_l L_kl o,   L_kl = sym(s_k s_l^T) - (s_k.s_l) 1 - sym(skew((e.s_k) e x s_l))

which shortens the arms of a section that twists (propeller moment) or bends. Acceleration fields linear in
position, those of spin, accelerated base and gravity gradient, only depend on int o (L_kl o)^T dm. The body gets the
least number of shapes W o, W uniform along it, that give these integrals exactly; their amplitudes are dependent on the
coordinates (`FlexibleBody.slaves`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.body import FlexibleBody, MassMoments
from femflex.fem.structure import Structure
from femflex.fem.tables import SectionInertia
from femflex.reduction.strain.condense import recombined

KIND = "section"
FAST = 10.0  # a spin over the body's lowest frequency, in which
NEGLIGIBLE = 1e-3  # of a squared frequency is left out
FLAT = 1e-12  # second moment over the largest, below which sections have no extent in a direction
LEVI_CIVITA = np.array([np.cross(a, b) for a in np.eye(3) for b in np.eye(3)]).reshape(3, 3, 3)  # eps_jkl


@dataclass(frozen=True, eq=False)
class Sections:
    """Sections of beams at p stations: int o o^T dm (p, 3, 3), unit vector along the beam (p, 3), turn (p, 3, n)."""

    second: Array
    axis: Array
    turn: Array

    @property
    def extent(self) -> Array:
        """The second moments [kg m^2] with those of negative mass (no rotary inertia) counted as positive, (p, 3,
        3)."""
        size, V = np.linalg.eigh(self.second)
        return np.asarray((V * np.abs(size)[:, None]) @ V.swapaxes(1, 2))


def sections_of(structure: Structure, phi: Array) -> Sections | None:
    """All sections of a structure's beams with rotations by shapes phi (n_dof, n) [m, rad]; None without beams."""
    raw, parts = structure.T @ phi, []
    for block in structure.inertia:
        if isinstance(block, SectionInertia):
            turn = np.matmul(block.turn, raw[block.dofs][:, None])
            axis = np.broadcast_to(block.axis[:, None], block.second.shape[:3])
            parts.append((block.second.reshape(-1, 3, 3), axis.reshape(-1, 3), turn.reshape(-1, 3, phi.shape[1])))
    if not parts:
        return None
    return Sections(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def with_turned_sections(body: FlexibleBody, sections: Sections, free: Sequence[int] | IntArray) -> FlexibleBody:
    """The body with dependent shapes W o, kind "section". free (n,): numbers of the coordinates they depend on.

    No shape is added if a spin of FAST times the lowest frequency changes all squared frequencies by less than
    NEGLIGIBLE.
    """
    free, n = np.asarray(free, np.int64), body.n_modes
    S = sections.extent.sum(axis=0)
    size, V = np.linalg.eigh(S)
    has_extent = size > FLAT * max(size[-1], np.finfo(float).tiny)
    if not len(free) or not has_extent.any() or not size[-1] > 0:
        return body
    inverse_root = (V[:, has_extent] / np.sqrt(size[has_extent])) @ V[:, has_extent].T
    integrals = np.einsum(
        "ijab,ik->jkab", second_order(replace(sections, turn=sections.turn[:, :, free])), inverse_root
    )
    weight = _weights(body)[free] * np.trace(S) ** 0.25
    U, part, _ = np.linalg.svd((integrals * np.outer(weight, weight)).reshape(9, -1), full_matrices=False)
    U = U[:, part > NEGLIGIBLE]
    if not U.shape[1]:
        return body
    slaves = np.zeros((U.shape[1], n, n))
    slaves[np.ix_(np.arange(len(slaves)), free, free)] = np.einsum(
        "xm,xab->mab", U, integrals.reshape(9, *integrals.shape[2:])
    )
    return _extended(body, sections, U.T.reshape(-1, 3, 3) @ inverse_root, S, slaves)


def second_order(sections: Sections) -> Array:
    """int o_i (L_kl o)_j dm over all sections, (3, 3, n, n) with indices i, j, k, l."""
    Q, s = sections.second, sections.turn
    twist, across = np.einsum("pi,pik->pk", sections.axis, s), np.cross(sections.axis[:, :, None], s, axis=1)
    along = np.einsum("pim,pmk,pjl->ijkl", Q, s, s, optimize=True)
    twisted = np.einsum("pim,jmn,pk,pnl->ijkl", Q, LEVI_CIVITA, twist, across, optimize=True)
    unsymmetric = along + twisted
    return np.asarray(
        (unsymmetric + unsymmetric.swapaxes(2, 3)) / 2 - np.einsum("pij,pmk,pml->ijkl", Q, s, s, optimize=True)
    )


def _weights(body: FlexibleBody) -> Array:
    """Root of the weight (n,) of the work of spin on each coordinate, over its stiffness and that of the spin."""
    Me = np.diag(body.moments.elastic_mass())
    square = np.maximum(np.diag(body.strain.V1) / Me, np.finfo(float).tiny)
    spin = FAST**2 * square.min()
    return np.asarray(np.sqrt(spin / (square + spin) / Me))


def _extended(body: FlexibleBody, sections: Sections, W: Array, S: Array, slaves: Array) -> FlexibleBody:
    """The body with shapes W o (m, 3, 3) after its own, S = int o o^T dm over the sections' extent.

    If this is not their mass (no rotary inertia), only the couplings of W o to fields and rigid motions are those of
    the sections. The inertia of the shapes themselves, of higher order, is not, and stays positive.
    """
    n, m = body.n_shapes, len(W)
    parts = recombined(body, np.eye(n, n + m), np.eye(n))
    moments = parts["moments"]
    second = moments.second.copy()
    moved = np.einsum("abd,pbk,pdc->kac", LEVI_CIVITA, sections.turn, sections.extent, optimize=True)
    products = np.einsum("zac,mbc->zamb", np.concatenate([S[None], moved]), W)
    second[: 1 + n, :, 1 + n :], second[1 + n :, :, : 1 + n] = products, products.transpose(2, 3, 0, 1)
    second[1 + n :, :, 1 + n :] = np.einsum("mbc,cd,led->mble", W, S, W, optimize=True)
    kinds = body.kinds or ("",) * n
    omega = body.omega if body.omega.size else np.full(n, np.nan)
    parts["moments"] = MassMoments(moments.mass, moments.first, second)
    return replace(body, **parts, slaves=slaves, kinds=kinds + (KIND,) * m, omega=np.append(omega, np.full(m, np.nan)))
