"""A Structure about a deflected state, with the mesh, masses and strains of that state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.fem.family import SkinPart
from femflex.fem.relaxed import RelaxedStrain
from femflex.fem.structure import Structure
from femflex.fem.tables import InertiaBlock, StrainBlock, mass_and_stiffness
from femflex.fem.tension.strain import TensionStrain


def deflected(structure: Structure, x: Array) -> Structure:
    """Return the structure about displacements x (n_dof,) [m, rad] of its own dofs, with the positions, stress and
    strain energy of that state.

    It is exact for tethers and membranes at any displacement: the energy of d is V(x + d) - V(x). For beams, plates and
    solids the stress of the linear strain of x is taken, so that x must be small compared with their size. f0 is the
    elastic force at x, which the loads of an equilibrium balance.
    """
    raw = structure.T @ x
    strain = tuple(_strain(block, raw) for block in structure.strain)
    inertia = tuple(_moved_inertia(block, raw) for block in structure.inertia)
    points = structure.mesh.points + (structure.translation @ x).reshape(-1, 3)
    M, K0 = mass_and_stiffness(inertia, strain, structure.T)
    return replace(
        structure,
        mesh=replace(structure.mesh, points=points),
        M=M,
        K0=K0,
        inertia=inertia,
        strain=strain,
        skin_parts=tuple(partial(_skin, part, raw) for part in structure.skin_parts),
        places=tuple(
            replace(strain_places, x=block.places)
            if isinstance(block, TensionStrain) and strain_places is not None
            else strain_places
            for block, strain_places in zip(strain, structure.places, strict=True)
        ),
    )


def tension_blocks(structure: Structure) -> tuple[TensionStrain, ...]:
    """Return the strain blocks of a structure that carry tension only."""
    return tuple(block for block in structure.strain if isinstance(block, TensionStrain))


def _strain(block: StrainBlock, raw: Array) -> Any:
    return block.deflected(raw) if isinstance(block, TensionStrain) else RelaxedStrain(block, raw)


def _moved_inertia(block: Any, raw: Array) -> InertiaBlock:
    block_at_state: InertiaBlock = replace(block, rho=block.rho + block.shapes(raw[:, None], slice(None))[..., 0])
    return block_at_state


def _skin(part: Callable[[], SkinPart], raw: Array) -> SkinPart:
    skin_part = part()
    displacements = np.bincount(skin_part.rows, skin_part.values * raw[skin_part.cols], skin_part.points.size)
    return replace(skin_part, points=skin_part.points + displacements.reshape(-1, 3))
