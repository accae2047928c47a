"""What is said of sheets so wide and thin that large bends leave no room for their crosswise curvature."""

from __future__ import annotations

import numpy as np

from femflex.fem.plate.strain import PlateStrain
from femflex.fem.structure import Structure
from femflex.reduction import ModeSet

CROSSWISE = 10.0  # width^2 curvature / thickness (Searle's parameter) from which shapes that curve crosswise are stiff
SMALL = 0.05  # bend over length from which it matters


def of_sheet(structure: Structure, modes: ModeSet) -> str:
    """What should be said of a set without third derivatives on sheets; nothing where it will do.

    A bend w of a length L, curvature 2 w / L^2, flattens a width b across where b^2 2 w / (L^2 h) is large: vibration
    shapes have the crosswise curvature of small bends. On 1 m x 0.6 m x 1.5 mm the sag was 6 % short of the elastica of
    the cylindrical bend where it is 20, 18 % where it is 40.
    """
    plates = [block for block in structure.strain if isinstance(block, PlateStrain)]
    if not plates or "third derivative" in modes.kinds:
        return ""
    thickness = min(float(np.sqrt(12 * C[3, 3] / C[0, 0])) for C in (block.elastic[0, 0] for block in plates))
    length, width = _extents(structure.mesh.points)
    if not width:
        return ""
    bend = CROSSWISE * thickness * length**2 / (2 * width**2)
    if bend > SMALL * length:
        return ""
    return (
        f"a sheet {width:.3g} m wide and {thickness:.3g} m thick, bent by more than some {bend:.2g} m, cannot curve "
        "crosswise as its shapes do, which are too stiff there: give it third_derivatives = 1 in its reduction"
    )


def _extents(points: np.ndarray) -> tuple[float, float]:
    """The largest and the second largest extent of points (p, 3) along their principal axes [m]."""
    _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    largest = np.sort(np.ptp(points @ axes.T, axis=0))[::-1]
    return float(largest[0]), float(largest[1])
