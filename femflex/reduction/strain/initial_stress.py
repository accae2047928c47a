"""Initial stress, and the part of it that supports react."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.deflected import tension_blocks, with_settled_stress
from femflex.fem.structure import Structure
from femflex.fem.tables import StrainBlock
from femflex.reduction.boundary.rigid import RIGID, Groups, held_dofs
from femflex.reduction.boundary.supported import unstressed
from femflex.reduction.limits import LEAST_REMAINING_STRESS, LOST_BY_RELAXATION, MOVED_BY_RELAXATION, SMALL_STRAIN
from femflex.reduction.modes.vibration import ModeSet
from femflex.reduction.preload.equilibrium import is_known, static_equilibrium
from femflex.warning import warn_of_physics

RELAXED_BY = ("let go",)  # key of the largest of these displacements [m] in a relaxed structure


def relaxed(structure: Structure, clamp: Groups = ()) -> Structure:
    """The structure in equilibrium with its initial stress and with the clamp groups fixed: the remaining stress.

    In a heated cantilever no stress remains, in a beam heated between two walls all of it. The small displacement of
    the relaxation is not stored: the mesh is the shape at equilibrium. Without a clamp the structure is free. A
    structure without initial stress, or about an equilibrium with these clamps, is returned unchanged. Structures with
    tethers or membranes are brought to their `static_equilibrium`.
    """
    clamped = held_dofs(structure, clamp)
    if is_known(structure, "at rest", clamped):
        return structure
    if tension_blocks(structure):
        return static_equilibrium(structure, clamp)
    if not structure.stressed:
        return structure
    result: Structure = structure.recalled(("relaxed", clamped.tobytes()), lambda: _relaxed(structure, clamped))
    return result


def _relaxed(structure: Structure, held: IntArray) -> Structure:
    x = relaxation(structure, held)
    result = with_settled_stress(structure, x)
    displacement = np.linalg.norm((structure.translation @ x).reshape(-1, 3), axis=1)
    result.known[RELAXED_BY] = (float(displacement.max(initial=0.0)),)
    if RIGID in structure.known:  # the mesh is unchanged, and its rigid motions too
        result.known[RIGID] = structure.known[RIGID]
    structure.known.pop(("K0", held.tobytes()), None)  # these factors are not used any more
    result.known["at rest", held.tobytes()] = (True,)
    return result


def relaxation(structure: Structure, held: IntArray) -> Array:
    """Linear static response (n_dof,) [m, rad] to the unbalanced forces of initial stress, with these dofs fixed."""
    supports = unstressed(structure, held)
    x = np.zeros(structure.n_dof)
    x[supports.stiff] = supports.factors.solve(
        -structure.f0[supports.stiff]
    )  # internal forces are in equilibrium: no reactions
    return x


def warn_if_slack(structure: Structure, modes: ModeSet) -> None:
    """Warn if supports do not react the initial stress, so that linear strain keeps stiffness that would vanish."""
    if not (structure.stressed and modes.n_modes) or is_known(structure, "at rest", modes.held):
        return
    if not structure.f0.any():
        return
    if tension_blocks(structure):
        _warn_if_unbalanced(structure, modes.held)
        return
    released = float(-structure.f0 @ relaxation(structure, modes.held)) / 2
    share = released / stress_energy(structure)
    if share > LOST_BY_RELAXATION:
        warn_of_physics(
            f"supports do not hold the initial stress: static motion would release {share:.0%} of its energy, over "
            f"{LOST_BY_RELAXATION:.0%}, and linear strain keeps the stiffening of all of it; reduce the relaxed "
            "structure instead"
        )


def _warn_if_unbalanced(structure: Structure, held: IntArray) -> None:
    """Warn if tethers or membranes are not in equilibrium under their initial stress with these dofs fixed."""
    free = np.delete(np.arange(structure.n_dof), held)
    left, whole = (float(np.abs(f).max(initial=0.0)) for f in (structure.f0[free], structure.f0))
    if left > SMALL_STRAIN * whole:
        warn_of_physics(
            f"the tension of tethers or membranes leaves {left:.3g} N unbalanced, over {SMALL_STRAIN:.0%} of its "
            f"largest force on a dof ({whole:.3g} N); reduce the structure about its `static_equilibrium` instead"
        )


def warn_of_initial_stress(name: str, before: Structure, after: Structure, is_intended: bool = True) -> None:
    """Warn of a structure whose initial stress relaxes on its supports, or strains it beyond small strain.

    name           of the structure, for the message
    before, after  the structure before and after `relaxed`
    is_intended    whether the stress is intended; unintended thermal stress that relaxes is not reported
    """
    if not before.stressed:
        return
    remaining = stress_energy(after) / max(stress_energy(before), 1e-300)
    if is_intended and remaining < LEAST_REMAINING_STRESS:
        warn_of_physics(
            "{body_or_joint}: its clamps sustain {value:.0%} of the energy of the initial stress (limit {limit:.0%}); "
            "the rest relaxed before its modes were computed.",
            body_or_joint=name,
            value=remaining,
            limit=LEAST_REMAINING_STRESS,
            remedy="Clamp every group that reacts the stress, such as both ends",
        )
    elif (moved := after.known.get(RELAXED_BY, (0.0,))[0]) > MOVED_BY_RELAXATION * (size := _size(after)):
        warn_of_physics(
            "{body_or_joint}: what its supports do not hold of its initial stress moves it by up to {moved:.4g} m, "
            "{value:.2g} of its size (limit {limit:g}). The modes are those after that, but the mesh stays as it is: "
            "this displacement is in no result.",
            body_or_joint=name,
            value=moved / size,
            limit=MOVED_BY_RELAXATION,
            remedy="Add it where it counts, or mesh the deformed shape",
            moved=moved,
        )
    largest = largest_strain(before, after)
    if largest > SMALL_STRAIN:
        warn_of_physics(
            "{body_or_joint}: its initial stress strains it by up to {value:.1%}, and strain is taken to be small, "
            "below {limit:.0%}.",
            body_or_joint=name,
            value=largest,
            limit=SMALL_STRAIN,
            remedy="Check prestress, thermal strain and units",
        )


def largest_strain(given: Structure, left: Structure) -> float:
    """Largest strain of the remaining stress, in the components in which stress was prescribed."""
    largest = 0.0
    for before, after in zip(given.strain, left.strain, strict=True):
        n = before.linear_map.shape[0]
        named = np.abs(np.broadcast_to(before.stress, (*before.weight.shape, n))).max(axis=(0, 1)) > 0
        _, strain = _stress_and_strain(after)
        largest = max(largest, float(np.abs(strain[..., named]).max(initial=0.0)))
    return largest


def _size(structure: Structure) -> float:
    """Diagonal of the box around a structure [m]."""
    return float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))


def stress_energy(structure: Structure) -> float:
    """Strain energy of the initial stress, int sigma0.C^-1 sigma0 / 2 [J]."""
    total = 0.0
    for block in structure.strain:
        stress, strain = _stress_and_strain(block)
        total += float(np.sum(block.weight[..., None] * stress * strain)) / 2
    return total


def _stress_and_strain(block: StrainBlock) -> tuple[Array, Array]:
    """Stress (e, q, n) of a table of strains, and the least strain with this stress.

    In the table of a beam's shears, extension and bending have only the stiffness that couples them to shear.
    """
    stress = np.broadcast_to(block.stress, (*block.weight.shape, block.linear_map.shape[0]))
    if np.einsum("...ii->...i", block.elastic).all():
        strain = np.linalg.solve(block.elastic, stress[..., None])
    else:
        strain = np.matmul(np.linalg.pinv(block.elastic, rcond=1e-13, hermitian=True), stress[..., None])
    return stress, np.asarray(strain[..., 0], np.float64)
