"""Static responses of third order: the change of a shape itself when large bending stretches the structure.

Under a load that would bend a linear structure as phi, the static path is

    x = phi q + 1/2 theta q^2 + psi q^3 + ...,      K psi = -(1/2 (dK/dphi) theta + f3(phi)),

theta the static derivative of phi and f3 the part of the elastic force that is cubic in the displacements. A plate bent
by more than its thickness cannot take the transverse curvature of Poisson's ratio, except along its edges: psi
represents this, for which dozens of vibration modes would be needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.fem.plate.strain import PlateStrain
from femflex.fem.structure import Structure
from femflex.reduction.boundary.rigid import free_dofs
from femflex.reduction.large_deflection.bent_states import over_mass, state_at_amplitudes, state_energy
from femflex.reduction.large_deflection.derivatives import outside_set, scaled_derivatives
from femflex.reduction.limits import LARGEST_SHEET_DEFLECTION, SMALL_SHEET_DEFLECTION, WIDE_SHEET
from femflex.reduction.modes.vibration import ModeSet, ritz, static_response

FAR = 1e3  # displacement over size at which the cubic force is evaluated: other terms are rounding there
HELD = 1e-3  # share of the energy of a deflected state that the set may lack
NOTHING = 1e-6  # share of the cubic force, by its largest entry, that the static derivative leaves: rounding below it
FURTHER = 4.0  # largest deflection of a state over that of the previous one, whose odd and even parts predict it
ON_THE_WAY = 1e-2  # last Newton step over the displacement, for intermediate states
AT_THE_END = 1e-6  # likewise for the last state: residual stretch in its odd part would store far more than bending
STRETCHED = 3.0  # energy over the linear one, above which a structure stretches: it is no sheet that bends freely


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
    return modes.with_shapes(shapes, ("third derivative",) * psi.shape[1], omega)


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


# The change of the lowest shape of a flat sheet in large deflections, from static states.
#
# A sheet of width b, thickness h and curvature k keeps the transverse curvature of its vibration modes while b^2 k /
# h is small (Searle's parameter). Beyond, it becomes a cylinder except for strips along its edges. This change cannot
# be derived at rest: with the third derivative at rest (`third_derivatives`) a sheet with b^2 k / h of 100 is 6 % too
# stiff, with the change found at a deflection of 0.2 of its size 0.3 % at most, at smaller bends too.


def shape_at_deflection(structure: Structure, shape: ModeSet, start: float, deflection: float) -> Array | None:
    """The odd part (n_dof,) of the static displacements of a shape at a deflection [m] in either direction.

    shape: the clamped set of the shape alone. start [m]: deflection of the first state, where nonlinear effects begin.
    If further states are not found, or stretch, the last one before them is used. None if the first one stretches: then
    the stiffness is not that of bending. Raises ValueError if the first state is not found.
    """
    phi = shape.phi[:, 0]
    displacement = float(np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max())
    stiffness = float(over_mass(structure, shape)[0] * (phi @ (structure.M @ phi)))
    count = max(int(np.ceil(np.log(deflection / start) / np.log(FURTHER))), 1)
    amplitudes = np.geomspace(min(start, deflection), deflection, count + 1) / displacement
    odd, even = phi * amplitudes[0], scaled_derivatives(structure, shape)[:, 0] * stiffness * amplitudes[0] ** 2 / 2
    previous = amplitudes[0]
    for q in amplitudes:
        try:
            forward, backward = _states_in_both_directions(
                structure, shape, q, odd * (q / previous), even * (q / previous) ** 2
            )
        except ValueError:
            if q == amplitudes[0]:
                raise
            break
        if state_energy(structure, forward) > STRETCHED * stiffness * q**2 / 2:
            if q == amplitudes[0]:
                return None
            break
        odd, even, previous = (forward - backward) / 2, (forward + backward) / 2, q
    forward, backward = _states_in_both_directions(structure, shape, previous, odd, even, AT_THE_END)
    return np.asarray((forward - backward) / 2)


def _states_in_both_directions(
    structure: Structure, shape: ModeSet, q: float, odd: Array, even: Array, settled: float = ON_THE_WAY
) -> tuple[Array, Array]:
    """The states of amplitudes q and -q, from guesses of their odd and even part."""
    forward = state_at_amplitudes(structure, shape, np.array([q]), odd + even, settled)
    backward = state_at_amplitudes(structure, shape, np.array([-q]), 2 * even - forward, settled)
    return forward, backward


FLAT = 1e-6  # of the length: distance of a sheet's points from their plane


@dataclass(frozen=True)
class Sheet:
    """A wide thin sheet, all in [m].

    width, thickness
    bend              deflection above which its vibration shapes are too stiff
    size              diagonal
    """

    width: float
    thickness: float
    bend: float
    size: float

    def __str__(self) -> str:
        return f"a sheet {self.width:.3g} m wide and {self.thickness:.3g} m thick"


def sheet_of(structure: Structure) -> Sheet | None:
    """The Sheet of a structure of flat plates; None if it is none, or if its vibration shapes suffice.

    A bend w of a length L, curvature 2 w / L^2, flattens a width b across where b^2 2 w / (L^2 h) is large: vibration
    shapes have the crosswise curvature of small bends. On a sheet of 1 m x 0.6 m x 1.5 mm the deflection was 6 %
    below the elastica of cylindrical bending where this number is 20, 18 % where it is 40, and 37 % where it is 100.
    """
    plates = [block for block in structure.strain if isinstance(block, PlateStrain)]
    if not plates:
        return None
    thickness = min(float(np.sqrt(12 * C[3, 3] / C[0, 0])) for C in (block.elastic[0, 0] for block in plates))
    length, width, rise = _extents(structure.mesh.points)
    if not width or rise > FLAT * length:
        return None
    bend = WIDE_SHEET * thickness * length**2 / (2 * width**2)
    if bend > SMALL_SHEET_DEFLECTION * length:
        return None
    return Sheet(width, thickness, bend, float(np.hypot(length, width)))


def with_sheet_shapes(structure: Structure, modes: ModeSet, requested: int | None, deflection: float | None) -> ModeSet:
    """The set with the requested number of third derivatives, by default with the shape that a wide thin sheet needs.

    This shape is computed at the largest deflection of the sheet, or at rest if no static state is found there.
    """
    if requested is not None:
        return with_third_derivatives(structure, modes, requested)
    sheet = sheet_of(structure) if modes.held.size and modes.n_modes else None
    if sheet is None or deflection is not None:
        return modes
    try:
        return with_sheet_bends(structure, modes, sheet.bend, LARGEST_SHEET_DEFLECTION * sheet.size)
    except (ValueError, RuntimeError):
        try:
            return with_third_derivatives(structure, modes, 1)
        except ValueError:  # it has no third derivative
            return modes


def sheet_note(structure: Structure, modes: ModeSet, requested: int | None) -> str:
    """A note on the set of a wide thin sheet; empty if its modes suffice.

    requested: number of third derivatives that the case sets, if any
    """
    sheet, third = sheet_of(structure), "third derivative" in modes.kinds
    if sheet is None:
        return ""
    if not modes.held.size and not third and requested is None:
        return (
            f"{sheet}: bent by over {sheet.bend:.2g} m, it loses its transverse (anticlastic) curvature, and "
            "its modes are too stiff. Without a clamp no shape is added for this: set third_derivatives = 2, or use "
            "method = 'cantilever', which adds the shape by itself"
        )
    if third != (requested is None):
        return ""
    if third:
        return (
            f"{sheet}: bent by over {sheet.bend:.2g} m, it loses its transverse (anticlastic) curvature. Its "
            "lowest mode in that state is added as a coordinate (third_derivatives = 0 would leave it out)"
        )
    return (
        f"{sheet}: bent by over {sheet.bend:.2g} m, it loses its transverse (anticlastic) curvature, and its "
        "modes are too stiff. Remove third_derivatives = 0"
    )


def _extents(points: np.ndarray) -> tuple[float, float, float]:
    """The extents of points (p, 3) along their principal axes [m], in descending order."""
    _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    length, width, rise = np.sort(np.ptp(points @ axes.T, axis=0))[::-1]
    return float(length), float(width), float(rise)
