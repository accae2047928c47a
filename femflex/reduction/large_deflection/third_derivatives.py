"""Static answers of third order: how a shape itself changes when large bending stretches the structure.

Under a load that would bend a linear structure as phi, the static path is

    x = phi q + 1/2 theta q^2 + psi q^3 + ...,      K psi = -(1/2 (dK/dphi) theta + f3(phi)),

theta the static derivative of phi and f3 the part of the elastic force that is cubic in the displacements. A plate bent
by more than its thickness may not curve crosswise as far as Poisson's ratio would have it, its edges apart: psi holds
this, where vibration modes need dozens.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.boundary.clamps import free_dofs
from femflex.reduction.large_deflection.bent_states import over_mass
from femflex.reduction.large_deflection.derivatives import scaled_derivatives, without
from femflex.reduction.large_deflection.sheet_bends import changed_by_bending
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.statics import static_response
from femflex.reduction.modes.vibration import ritz

FAR = 1e3  # displacement over size at which the cubic force is read off: there it is all of the force but rounding
HELD = 1e-3  # share of a bent state's energy by which the set may lack its shape
NOTHING = 1e-6  # share of the cubic force, by its largest entry, that the static derivative leaves: rounding below it


def with_third_derivatives(structure: Structure, modes: ModeSet, n: int) -> ModeSet:
    """The set with psi of its n lowest shapes added, M-orthonormal, kind "third derivative"; coordinates of their own.

    They go before the static derivatives of pairs (`with_derivatives`), which they want too. omega of the added shapes
    is that of the structure confined to them. Raises ValueError when the set has fewer shapes, and where a shape has no
    third derivative: a beam that is free to draw in bends as under small loads.
    """
    if not 0 <= n <= modes.n_modes:
        raise ValueError(f"third derivatives of {n} shapes were requested; the set has {modes.n_modes}.")
    if not n:
        return modes
    lowest = np.sort(np.argsort(over_mass(structure, modes), kind="stable")[:n])
    return _with(
        structure, modes, np.column_stack([third_derivative(structure, modes.picked([int(k)])) for k in lowest])
    )


def with_sheet_bends(structure: Structure, modes: ModeSet, start: float, deflection: float) -> ModeSet:
    """The set with what its lowest shape turns into when a sheet is bent by a deflection [m], in place of psi.

    start [m]: deflection at which bends begin to differ from small ones (`changed_by_bending`). The set as it is where
    the structure stretches instead, or holds those bends: all but HELD of their energy. Raises ValueError as
    `changed_by_bending`.
    """
    lowest = modes.picked([int(np.argmin(over_mass(structure, modes)))])
    bent = changed_by_bending(structure, lowest, start, deflection)
    if bent is None:
        return modes
    psi = without(structure, modes, bent[:, None])
    if (psi * (structure.K @ psi)).sum() <= HELD * bent @ (structure.K @ bent):
        return modes
    return _with(structure, modes, psi)


def _with(structure: Structure, modes: ModeSet, psi: Array) -> ModeSet:
    omega, shapes = ritz(structure, without(structure, modes, psi))
    return replace(
        modes,
        phi=np.column_stack([modes.phi, shapes]),
        kinds=modes.kinds + ("third derivative",) * psi.shape[1],
        omega=np.append(modes.omega, omega),
    )


def third_derivative(structure: Structure, one: ModeSet) -> Array:
    """psi (n_dof,) of a set of one shape, scaled to unit strain energy phi.K phi = 1."""
    elastic = structure.internal_force
    phi = one.phi[:, 0] / np.sqrt(one.phi[:, 0] @ (structure.K @ one.phi[:, 0]))
    theta = scaled_derivatives(structure, one)
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    far = FAR * size / np.abs(structure.translation @ phi).max()
    cubic = (elastic.force(far * phi) - elastic.force(-far * phi)) / (2 * far**3) - structure.K @ phi / far**2
    both = elastic.second_derivative(np.column_stack([phi, theta]), np.array([0]), np.array([1]))
    load = -(both / 2 + cubic[:, None])
    free = free_dofs(structure, one.held)
    if np.abs(load[free]).max() <= NOTHING * np.abs(cubic[free]).max():
        raise ValueError(
            f"the third derivative of the shape at {one.omega[0]:.4g} rad/s is zero: large bending does not change it. "
            "Request fewer third derivatives."
        )
    return static_response(structure, one, load)[:, 0]
