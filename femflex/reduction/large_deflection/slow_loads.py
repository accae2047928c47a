"""Select loads whose static shapes can be added to vibration modes without making the body stiff."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy import linalg

from femflex.arrays import Array, BoolArray
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import DIRECTIONS, independent_columns
from femflex.reduction.large_deflection.bent_states import over_mass
from femflex.reduction.modes.residuals import residual_vectors
from femflex.reduction.modes.vibration import ModeSet, load_vectors, static_response
from femflex.reduction.strain.condense import FASTER

FASTEST = 8.0  # frequency of a load's static shape over the highest of a set that it may join: 6.5 for the rest of an
# end load beside one mode, and about 40 for an axial load on a beam 100 times as long as its radius of gyration
DRIVEN = 0.1  # share of the stretch by bending of one shape, above which a static shape is that stretch


def slow_loads(
    structure: Structure,
    modes: ModeSet,
    directions: Sequence[str] = (),
    loads: Mapping[str, Sequence[str]] | None = None,
    least: float = 0.0,
    linear: bool = False,
    others: Sequence[Array] = (),
) -> Array:
    """Load vectors (n_dof, k) of those accelerations and loads (`with_attachment`) whose static shapes are slow.

    The residual x of a static response, outside the modes, has a frequency sqrt(x.K x / x.M x). For an axial load on a
    slender beam it is far above those of the modes: it would be the only stiff coordinate of the body. The forces at a
    group are treated as one space, of which the slow part is used, and so are moments and accelerations: the result
    does not depend on the axes of the mesh.
    least: share of a load's static work that the set must lack for its shape to be added.
    others: further spaces of load vectors (n_dof, k).
    With many modes an axial load is not faster than that; unless strain is linear it is omitted where the derivatives
    of the set represent it (`is_second_order_response`).
    """
    highest = np.nanmax(modes.omega, initial=0.0)
    slow = [np.zeros((structure.n_dof, 0))]
    for F in (*_load_spaces(structure, directions, loads or {}), *others):
        x = residual_vectors(structure, modes, F)
        size = np.sqrt(np.einsum("in,in->n", x, structure.M @ x))
        F, x = F[:, size > 0.0] / size[size > 0.0], x[:, size > 0.0] / size[size > 0.0]
        independent = independent_columns(x)
        F, x = F[:, independent], x[:, independent]
        if not x.size:
            continue
        stiffness, combinations = linalg.eigh(x.T @ (structure.K @ x), x.T @ (structure.M @ x))
        F, x = F @ combinations, x @ combinations
        modal_work = ((modes.phi.T @ F) ** 2 / over_mass(structure, modes)[:, None]).sum(axis=0)
        is_kept = (stiffness < (FASTEST * highest) ** 2) & (stiffness > least * (stiffness + modal_work))
        if not linear:
            is_kept &= ~is_second_order_response(structure, modes, x)
        slow.append(F[:, is_kept])
    return np.concatenate(slow, axis=1)


def _load_spaces(
    structure: Structure, directions: Sequence[str], loads: Mapping[str, Sequence[str]]
) -> Iterator[Array]:
    """Load vectors (n_dof, k) of accelerations and of each group's loads, separately along axes and about axes."""
    for kind in (DIRECTIONS[:3], DIRECTIONS[3:]):
        if accelerations := [d for d in directions if d in kind]:
            yield load_vectors(structure, accelerations, {})
        for group, group_directions in loads.items():
            if of_kind := [d for d in group_directions if d in kind]:
                yield load_vectors(structure, [], {group: of_kind})


def is_second_order_response(structure: Structure, modes: ModeSet, shapes: Array) -> BoolArray:
    """(k,): whether each of the shapes (n_dof, k) [m, rad] is the stretch by bending of one shape of the set.

    The static derivative of phi_i has the strain energy theta_ii.K theta_ii, and a shape x represents the part
    (x.K theta_ii)^2 / x.K x of it. x is such a stretch if this is more than DRIVEN, and if x is FASTER than 2 omega_i.
    """
    if not shapes.size or not modes.n_modes:
        return np.zeros(shapes.shape[1], np.bool_)
    theta = -static_response(structure, modes, structure.internal_force.second_derivative(modes.phi))
    K_x = structure.K @ shapes
    stiffness, mass = np.einsum("in,in->n", shapes, K_x), np.einsum("in,in->n", shapes, structure.M @ shapes)
    energy = np.einsum("in,in->n", theta, structure.K @ theta)
    driven = (K_x.T @ theta) ** 2 > DRIVEN * np.outer(stiffness, energy)
    follows = stiffness[:, None] >= (2 * FASTER * modes.omega) ** 2 * mass[:, None]
    return np.asarray((driven & follows).any(axis=1))
