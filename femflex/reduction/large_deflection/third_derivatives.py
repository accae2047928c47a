"""Static responses of third order: the change of a shape itself when large bending stretches the structure.

Under a load that would bend a linear structure as phi, the static path is

    x = phi q + 1/2 theta q^2 + psi q^3 + ...,      K psi = -(1/2 (dK/dphi) theta + f3(phi)),

theta the static derivative of phi and f3 the part of the elastic force that is cubic in the displacements. A plate bent
by more than its thickness cannot take the transverse curvature of Poisson's ratio, except along its edges: psi
represents this, for which dozens of vibration modes would be needed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.fem.structure import Structure
from femflex.reduction.boundary.clamps import free_dofs
from femflex.reduction.large_deflection.bent_states import over_mass
from femflex.reduction.large_deflection.derivatives import outside_set, scaled_derivatives
from femflex.reduction.large_deflection.sheet_bends import shape_at_deflection
from femflex.reduction.modes.modeset import ModeSet
from femflex.reduction.modes.statics import static_response
from femflex.reduction.modes.vibration import ritz

FAR = 1e3  # displacement over size at which the cubic force is evaluated: other terms are rounding there
HELD = 1e-3  # share of the energy of a deflected state that the set may lack
NOTHING = 1e-6  # share of the cubic force, by its largest entry, that the static derivative leaves: rounding below it


def with_third_derivatives(structure: Structure, modes: ModeSet, n: int) -> ModeSet:
    """The set with psi of its n lowest shapes added, M-orthonormal, kind "third derivative"; coordinates of their own.

    They are added before the static derivatives of pairs (`with_derivatives`), which include them. omega of the added
    shapes is that of the structure confined to them. Raises ValueError if the set has fewer shapes, or if a shape has
    no third derivative: a beam that is free to foreshorten bends as under small loads.
    """
    if not 0 <= n <= modes.n_modes:
        raise ValueError(f"third derivatives of {n} shapes were requested; the set has {modes.n_modes}.")
    if not n:
        return modes
    lowest = np.sort(np.argsort(over_mass(structure, modes), kind="stable")[:n])
    return _with_shapes(
        structure, modes, np.column_stack([third_derivative(structure, modes.picked([int(k)])) for k in lowest])
    )


def with_sheet_bends(structure: Structure, modes: ModeSet, start: float, deflection: float) -> ModeSet:
    """The set with the lowest shape of a sheet at a deflection [m] added, instead of psi.

    start [m]: deflection at which nonlinear effects begin (`shape_at_deflection`). The set is unchanged if the
    structure stretches instead, or if the set contains this shape up to HELD of its energy. Raises ValueError as
    `shape_at_deflection`.
    """
    lowest = modes.picked([int(np.argmin(over_mass(structure, modes)))])
    bent = shape_at_deflection(structure, lowest, start, deflection)
    if bent is None:
        return modes
    psi = outside_set(structure, modes, bent[:, None])
    if (psi * (structure.K @ psi)).sum() <= HELD * bent @ (structure.K @ bent):
        return modes
    return _with_shapes(structure, modes, psi)


def _with_shapes(structure: Structure, modes: ModeSet, psi: Array) -> ModeSet:
    omega, shapes = ritz(structure, outside_set(structure, modes, psi))
    return replace(
        modes,
        phi=np.column_stack([modes.phi, shapes]),
        kinds=modes.kinds + ("third derivative",) * psi.shape[1],
        omega=np.append(modes.omega, omega),
    )


def third_derivative(structure: Structure, shape: ModeSet) -> Array:
    """The third derivative psi (n_dof,) of a set of one shape, scaled to unit strain energy phi.K phi = 1."""
    elastic = structure.internal_force
    phi = shape.phi[:, 0] / np.sqrt(shape.phi[:, 0] @ (structure.K @ shape.phi[:, 0]))
    theta = scaled_derivatives(structure, shape)
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    amplitude = FAR * size / np.abs(structure.translation @ phi).max()
    cubic = (elastic.force(amplitude * phi) - elastic.force(-amplitude * phi)) / (
        2 * amplitude**3
    ) - structure.K @ phi / amplitude**2
    both = elastic.second_derivative(np.column_stack([phi, theta]), np.array([0]), np.array([1]))
    load = -(both / 2 + cubic[:, None])
    free = free_dofs(structure, shape.held)
    if np.abs(load[free]).max() <= NOTHING * np.abs(cubic[free]).max():
        raise ValueError(
            f"the third derivative of the shape at {shape.omega[0]:.4g} rad/s is zero: large bending does not change "
            "it. Request fewer third derivatives."
        )
    return static_response(structure, shape, load)[:, 0]
