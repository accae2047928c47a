"""Wide thin sheets, which lose their transverse (anticlastic) curvature in large deflections, and their shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.fem.plate.strain import PlateStrain
from femflex.fem.structure import Structure
from femflex.reduction.large_deflection.third_derivatives import with_sheet_bends, with_third_derivatives
from femflex.reduction.limits import LARGEST_SHEET_DEFLECTION, SMALL_SHEET_DEFLECTION, WIDE_SHEET
from femflex.reduction.modes.vibration import ModeSet

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
