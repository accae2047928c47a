"""Selection of the dependent (statically condensed) derivatives: those faster than their excitation.

A dependent coordinate is at its static value, y = -3 V2_s delta delta / V1_ss. That holds while its excitation is slow
compared with its own frequency, and while the stiffness that others add to it, 6 V2_ss delta, is small compared with
its own: the condensed form leaves it out. The stretch due to bending is such a shape. The bending that a stretching or
twisting coordinate causes in a body already bent is not. It is slower than the stretch, and a tension of a third of
its buckling load changes its stiffness by a third. Frequencies tell the two apart.
"""

from __future__ import annotations

import numpy as np

from femflex.arrays import IntArray
from femflex.body import FlexibleBody
from femflex.body.symmetric import unpacked
from femflex.fem.eigen.modes import dense_modes

FASTER = 2.0  # frequency of a shape over that of its excitation, above which it is dependent


def dependent_derivatives(body: FlexibleBody, shapes: IntArray) -> IntArray:
    """Numbers (k,) of the shapes that are dependent on the others: FASTER than their excitation.

    The others, in their own modes of frequency omega_i, have the amplitudes 1 / omega_i^2 of equal static loads. The
    product i j of them excites shape s by V2_sij / (omega_i omega_j)^2, with a frequency omega_i + omega_j. The shape
    is compared with the root mean square of these sums, weighted by the squares of the excitations.
    """
    n, Me = body.n_modes, body.moments.elastic_mass()
    others = np.setdiff1d(np.arange(n), shapes)
    square, Q = dense_modes(body.strain.V1[np.ix_(others, others)], Me[np.ix_(others, others)])
    omega = np.sqrt(np.maximum(square, np.finfo(float).tiny))
    V2 = unpacked(body.strain.V2, n, 3)[np.ix_(shapes, others, others)]
    static = Q * (omega[0] / omega) ** 2
    drive = np.einsum("sij,ia,jb->sab", V2, static, static, optimize=True) ** 2
    drive_squares = np.einsum("sab,ab->s", drive, np.add.outer(omega, omega) ** 2)
    squares = np.diag(body.strain.V1)[shapes] / np.diag(Me)[shapes]
    return np.asarray(shapes[squares * drive.sum(axis=(1, 2)) >= FASTER**2 * drive_squares])
