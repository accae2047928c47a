"""Stiffness that is linear in the coordinates, and the rounding that it leaves in forces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.joints.places import body_places
from femflex.dynamics.motion.freedoms import frame_rate, usual_sizes

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


def rounding_forces(model: Model, t: float, x: Array, udot: Array) -> Array:
    """Return forces (n_u,) whose rounding may remain in the residual about x (n_x,) with accelerations udot (n_u,).

    What is large in one coordinate is summed up in others: the largest energy counts for all.
    """
    K, columns = linear_stiffness(model)
    M, sizes = np.abs(model.mass_matrix(t, x)), usual_sizes(model)
    elastic = np.abs(K) @ np.abs(np.where(columns >= 0, x[columns], 0.0))
    static = (elastic + M @ np.abs(udot) + np.abs(model.bias(t, x))) * sizes
    turning = np.diag(M) * (frame_rate(model.system) * sizes) ** 2  # of a spin about a principal axis nothing is left
    return np.asarray((static + turning).max(initial=0.0) / sizes)


def linear_stiffness(model: Model) -> tuple[Array, IntArray]:
    """Stiffness (n_u, n_u) of shapes and of springs on joint coordinates, and which coordinate each column multiplies.

    Columns of balls have no such coordinate (-1) and are zero.
    """
    K, columns = np.zeros((model.n_u, model.n_u)), np.full(model.n_u, -1, np.int64)
    for place in body_places(model.system):
        joint, e = place.joint, place.shapes_u
        plain = np.arange(len(joint.translations) + (len(joint.rotations) if joint.ball is None else 0))
        K[place.u + plain, place.u + plain], columns[place.u + plain] = joint.stiffness[plain], place.q + plain
        K[np.ix_(e, e)] = (place.body.strain.V1 + place.body.strain.V1.T) / 2
        columns[e] = place.shapes_q
    return K, columns
