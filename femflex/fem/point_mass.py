"""Concentrated masses and inertias at named points, as equivalent points of the inertia table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import SkipValidation

from femflex.arrays import Array
from femflex.fem.assembly.numbering import Numbering
from femflex.fem.connections.connection import skew
from femflex.fem.tables import DenseInertia
from femflex.noun.inertia import InertiaMatrix
from femflex.noun.table import Table
from femflex.noun.values import Mass, Matrix, Position, Vector

if TYPE_CHECKING:
    from femflex.mesh import Mesh


ROUNDED = 1e-3  # relative error of the triangle inequality that the few digits of decks may cause


class PointMass(Table):
    """A concentrated mass at every point of a mesh group."""

    group: str
    """Mesh group; every point of it gets the mass."""
    mass: Mass
    """Mass at each point."""
    inertia: InertiaMatrix | None = None
    """Moments of inertia about the mass's own centre, in body axes. Default: none."""
    offset: Position = (0.0, 0.0, 0.0)
    """Position of the mass's centre relative to the node."""


class DeckMass(PointMass):
    """A concentrated mass of a deck; its inertia may leave out axes, and is checked where it is read."""

    inertia: SkipValidation[Matrix | None] = None
    """Moments of inertia about the mass's own centre, mesh axes."""
    offset: SkipValidation[Vector] = (0.0, 0.0, 0.0)
    """Position of the mass's centre relative to the node."""


def check_inertia(inertia: Array, where: str) -> None:
    """Raise ValueError, which begins with `where`, unless inertia (3, 3) [kg m^2] is one of a distribution of mass.

    It may leave out the inertia about one or two axes, as decks do for rotations that do not matter, and be rounded to
    the few digits of a deck.
    """
    if inertia.shape != (3, 3) or not np.isfinite(inertia).all():
        raise ValueError(f"{where} is {inertia.tolist()}; give a 3 x 3 matrix of finite numbers")
    if not np.allclose(inertia, inertia.T, rtol=1e-9, atol=1e-12 * np.abs(inertia).max()):
        raise ValueError(f"{where} is not symmetric: {inertia.tolist()}")
    principal = np.linalg.eigvalsh(inertia)
    largest, moments = np.abs(principal).max(), ", ".join(f"{moment:.6g}" for moment in principal)
    if principal[0] < -1e-6 * largest:
        raise ValueError(f"{where} has a negative principal moment among {moments} kg m^2; check the signs")
    if principal[0] > 1e-6 * largest and principal[0] + principal[1] < principal[2] - ROUNDED * largest:
        raise ValueError(
            f"{where} breaks the triangle inequality: of its principal moments {moments} kg m^2 the two smaller must "
            "sum to at least the largest. Check entries and units"
        )


def equivalent_points(mass: float, inertia: Array) -> tuple[Array, Array]:
    """Masses (k,) and positions (k, 3) of six points with this mass and this inertia (3, 3) about their centre.

    int r r^T dm = tr(J)/2 1 - J = sum_k q_k v_k v_k^T; a pair of points m/6 at +-sqrt(3 q_k / m) v_k gives each term.
    An inertia that no body has, as about one axis alone, has a q_k below zero: its pair has the mass -m/6, and a
    seventh point at the centre keeps the sum.
    """
    second, axes = np.linalg.eigh(np.trace(inertia) / 2 * np.eye(3) - inertia)
    second = np.where(np.abs(second) > 1e-12 * np.abs(second).max(), second, 0.0)
    arms = np.sqrt(3 * np.abs(second) / mass) * axes
    masses, positions = np.tile(np.where(second < 0, -mass, mass) / 6, 2), np.concatenate([arms.T, -arms.T])
    if (second < 0).any():
        masses, positions = np.append(masses, mass - masses.sum()), np.concatenate([positions, np.zeros((1, 3))])
    return masses, positions


def point_mass_block(mesh: Mesh, point_mass: PointMass, numbering: Numbering) -> DenseInertia:
    """Inertia block of a concentrated mass at each node of its group: u + theta x r at the equivalent points.

    Nodes of flat plates turn only about axes in the plate: the inertia about its normal takes part in the body's
    motion, not in the elastic one. Raises ValueError at nodes without a member, and for an inertia or an offset at
    nodes that have no rotation.
    """
    nodes = mesh.group_points(point_mass.group)
    translation, rotation = numbering.translation_of(nodes), numbering.rotation_of(nodes)
    loose = int((translation[:, 0] < 0).sum())
    if loose:
        raise ValueError(
            f"point mass at group {point_mass.group!r}: {loose} of its {len(nodes)} nodes belong to no member; "
            "put the mass on a group that lies on a member"
        )
    masses, arms = _distribution(point_mass)
    turns = bool(np.any(arms))
    if turns and (rotation < 0).any():
        raise ValueError(
            f"point mass at group {point_mass.group!r} has an inertia or an offset, but its nodes have no rotation "
            "(solid elements); give a mass alone, or spread points of mass over several nodes"
        )
    N = np.concatenate([np.broadcast_to(np.eye(3), (len(masses), 3, 3)), -skew(arms)], axis=2)
    dofs = np.concatenate([translation, rotation], axis=1) if turns else translation
    return DenseInertia(
        dofs=dofs,
        dm=np.broadcast_to(masses, (len(nodes), len(masses))),
        rho=mesh.points[nodes][:, None] + arms,
        N=N[None, :, :, : dofs.shape[1]],
    )


def _distribution(point_mass: PointMass) -> tuple[Array, Array]:
    offset = np.asarray(point_mass.offset, float)
    if point_mass.inertia is None or not np.any(point_mass.inertia):
        return np.array([point_mass.mass], float), offset[None]
    masses, arms = equivalent_points(point_mass.mass, np.asarray(point_mass.inertia, float))
    return masses, arms + offset
