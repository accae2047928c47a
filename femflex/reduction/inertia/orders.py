"""Combinations of shapes that are of first order in a deflection, and those of second order.

A body bent by a small angle w' is foreshortened by w'^2 / 2: rotations are large, and strains small. Bending and
torsion are of first order, the stretch of members, sheets and solids of second. To fourth order the energy of
x = b + m, b of first order and m of second, is

    V = 1/2 [V1 xx + 2 V2 bbb + 6 V2 bbm + V3 bbbb].

All other terms are of fifth order and above. With dependent shapes, which do not respond to them (`condense`), they
would stiffen a deflected body: if a retained stretch takes part in the foreshortening, no shape compensates its
u'^2 / 2. A cantilever bent by 6.6 % of its length was 8.7 % too stiff with one stretching mode among eighteen.

Rotation distinguishes the two. With V_m the membrane energy of a combination, V_r what the membrane would store if it
were stretched as far as it turns, and V all of its energy, V_m / (V_r + V) is 0 for bending and torsion of thin parts,
(pi thickness / wavelength)^2 / 3 for bending of solids, and between 1/3 and 1 for a stretch, also where it bends
other members of a folded structure. The bending of a curved body stretches it, but little compared with its rotation:
about 5 (rise / span)^2. It is of first order, and all of its terms are kept.
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.fem.tables import StrainBlock, element_chunks
from femflex.reduction.inertia.moments import linear_stiffness, strain_stiffness

MEMBRANE = {"line": [0], "plate": [0, 1, 2], "solid": [0, 1, 2, 3, 4, 5]}  # strains that squares of rotations enter
IN_PLANE = np.array([[0.25, -0.25], [-0.25, 0.25]])  # of (v,x - u,y)^2 / 4, the square of a turn in the plane
SECOND = 0.1  # V_m / (V_r + V) from which on a combination is of second order


def first_order_part(structure: Structure, phi: Array) -> Array:
    """P (n, n) [1]: of amplitudes d of shapes phi (n_dof, n) [m, rad], P d is of first order and d - P d of second.

    The combinations of second order are those without strain energy in common with any of first, so that bending
    does not drive them to first order. P does not depend on the basis in which the shapes span their space.
    """
    n = phi.shape[1]
    raw = structure.T @ phi
    V, (V_m, V_r) = strain_stiffness(structure.strain, raw), membrane_energies(structure, raw)
    unit = np.sqrt(np.diag(V))
    part, x = linalg.eigh(V_m / np.outer(unit, unit), (V_r + V) / np.outer(unit, unit))
    if part[-1] < SECOND:
        return np.eye(n)
    b = x[:, part < SECOND] / unit[:, None]
    K = linear_stiffness(structure.K, phi)
    return np.asarray(b @ np.linalg.solve(b.T @ K @ b, b.T @ K))


def membrane_energies(structure: Structure, raw: Array) -> tuple[Array, Array]:
    """V_m and V_r (n, n) [J] of shapes on the raw dofs (n_raw, n); the resultants' energy N A^-1 N where A couples.

    V_r = int A_ss g.Q_s g over the normal strains s, whose quadratic part is g.Q_s g / 2. Turns of plates in their own
    planes count too, though their strain lacks these squares: a web that bends in its plane turns far.
    """
    n = raw.shape[1]
    stretched, turned = np.zeros((n, n)), np.zeros((n, n))
    for block, places in zip(structure.strain, structure.places, strict=True):
        if places is None:
            continue
        for chunk in element_chunks(len(block.dofs), block.weight.shape[1] * 20 * n):
            add_membrane_energies(stretched, turned, block.sampled(chunk), raw, places.kind)
    return (stretched + stretched.T) / 2, (turned + turned.T) / 2


def add_membrane_energies(stretched: Array, turned: Array, part: StrainBlock, raw: Array, kind: str) -> None:
    """Add V_m and V_r (n, n) [J] of a part of a strain table."""
    strains = MEMBRANE[kind]
    g = part.gradients(raw, slice(None))
    resultants = part.elastic[..., strains, :] @ part.linear_map
    A, Q = part.elastic[..., strains, :][..., strains], part.quadratic_map[strains].copy()
    if kind == "plate" and not Q[:2, 1:3, 1:3].any():  # shells have these squares in their strain
        Q[:2, 1:3, 1:3] += IN_PLANE
    N = np.matmul(resultants, g) * part.weight[:, :, None, None]
    stretched += np.einsum("eqsi,eqsj->ij", N, np.linalg.solve(A, np.matmul(resultants, g)), optimize=True)
    for s in np.flatnonzero(np.einsum("sgg->s", Q)):
        stiffness = part.weight * A[..., s, s]
        turned += np.einsum("eq,eqgi,gh,eqhj->ij", stiffness, g, Q[s], g, optimize=True)


def membrane_cubic(structure: Structure, phi: Array) -> Array:
    """int N_k.B_ij over the membranes of lines and plates, its symmetric part (n, n, n), for shapes phi (n_dof, n)
    [m, rad].

    The part of V2 by which the membrane forces of one shape work on the shortening by two. Solids are left out: their
    stress is that of bending and torsion too.
    """
    n, raw = phi.shape[1], structure.T @ phi
    total = np.zeros((n, n, n))
    for block, places in zip(structure.strain, structure.places, strict=True):
        if places is None or places.kind == "solid":
            continue
        strains = MEMBRANE[places.kind]
        for chunk in element_chunks(len(block.dofs), block.weight.shape[1] * len(strains) * n * (n + 20)):
            part = block.sampled(chunk)
            g = part.gradients(raw, slice(None))
            N = np.matmul(part.elastic[..., strains, :] @ part.linear_map, g) * part.weight[:, :, None, None]
            for at, s in enumerate(strains):
                shortening = np.matmul(g.swapaxes(2, 3), part.quadratic_map[s] @ g) / 2
                total += np.tensordot(N[:, :, at].reshape(-1, n).T, shortening.reshape(-1, n, n), axes=1)
    return np.asarray((total + total.transpose(1, 0, 2) + total.transpose(1, 2, 0)) / 3)
