"""Which loads have static shapes that a set of vibration modes can take in without becoming stiff."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from scipy import linalg

from femflex.arrays import Array, BoolArray
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import DIRECTIONS, independent_columns
from femflex.reduction.large_deflection.bent_states import over_mass
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.residuals import residual_vectors
from femflex.reduction.modes.statics import static_response
from femflex.reduction.modes.vibration import load_vectors
from femflex.reduction.strain.following import FASTER

FASTEST = 8.0  # frequency of a load's static shape over the highest of a set that it may join: the rest of an end load
# that one mode leaves has 6.5, and a pull along a beam 100 times its radius of gyration some 40
DRIVEN = 0.1  # share of the stretch of one shape's bending from which on a static shape is that stretch


def slow_loads(
    structure: Structure,
    modes: ModeSet,
    directions: Sequence[str] = (),
    loads: Mapping[str, Sequence[str]] | None = None,
    fastest: float = FASTEST,
    least: float = 0.0,
    linear: bool = False,
) -> Array:
    """Of the accelerations and loads (`with_attachment`) those whose static shapes are slow compared with a set.

    Load vectors (n_dof, k). What the modes leave of the answer to a load has a frequency of its own,
    sqrt(x.K x / x.M x). That of a pull along a slender beam is far above the modes': it would be the one stiff
    coordinate of the body. Forces at a group count as one space, of which the slow part is taken, moments and
    accelerations likewise: the axes in which a mesh is given do not matter. fastest: over the highest of the set.
    least: share of a load's static work by which the set must fall short before the shape is worth a coordinate.
    With many modes a pull is no faster than that; unless the strain is linear it is left out as what the set's
    derivatives hold already (`brought_about`).
    """
    highest = np.nanmax(modes.omega, initial=0.0)
    found = [np.zeros((structure.n_dof, 0))]
    for F in _spaces(structure, directions, loads or {}):
        x = residual_vectors(structure, modes, F)
        size = np.sqrt(np.einsum("in,in->n", x, structure.M @ x))
        F, x = F[:, size > 0.0] / size[size > 0.0], x[:, size > 0.0] / size[size > 0.0]
        own = independent_columns(x)
        F, x = F[:, own], x[:, own]
        if not x.size:
            continue
        stiffness, ways = linalg.eigh(x.T @ (structure.K @ x), x.T @ (structure.M @ x))
        F, x = F @ ways, x @ ways
        answered = ((modes.phi.T @ F) ** 2 / over_mass(structure, modes)[:, None]).sum(axis=0)
        kept = (stiffness < (fastest * highest) ** 2) & (stiffness > least * (stiffness + answered))
        if not linear:
            kept &= ~brought_about(structure, modes, x)
        found.append(F[:, kept])
    return np.concatenate(found, axis=1)


def _spaces(structure: Structure, directions: Sequence[str], loads: Mapping[str, Sequence[str]]) -> Iterator[Array]:
    """Load vectors (n_dof, k) of accelerations and of each group's loads; along axes and about them apart."""
    for kind in (DIRECTIONS[:3], DIRECTIONS[3:]):
        if base := [d for d in directions if d in kind]:
            yield load_vectors(structure, base, {})
        for group, given in loads.items():
            if own := [d for d in given if d in kind]:
                yield load_vectors(structure, [], {group: own})


def brought_about(structure: Structure, modes: ModeSet, shapes: Array) -> BoolArray:
    """Whether each of the shapes (n_dof, k) [m, rad] is what the bending of one of the set brings about.

    Static derivatives of phi_i alone hold the strain energy theta_ii.K theta_ii; a shape x that is DRIVEN holds its
    share (x.K theta_ii)^2 / x.K x, and follows where it is FASTER than 2 omega_i.
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
