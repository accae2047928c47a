"""Sections of shells that vary over their surface: thickness, density, non-structural mass and axes as fields.

A field is a number, a formula of x, y and z, values of all points of the mesh (n_points,), or by cell type values of
the elements in the order of the group, (e,) or (e, corners). Values at nodes are those of corners; between them they
are linear along the sides.

A thickness other than the section's scales all its plies: with f = h / h_0

    A = f A_0,  B = f^2 B_0,  D = f^3 D_0,  S = f S_0,  mass = f mass_0,  rotary inertia f^3 of the section's

and with an offset d from the nodes, B + d A and D + 2 d B + d^2 A.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.fem.formula import formula_of_position
from femflex.fem.sections.laminates import PlateSection, scaled_plies
from femflex.mesh.cells import CELL_TYPES


@dataclass(frozen=True, eq=False)
class Patch:
    """Elements of one cell type: their nodes (e, k), the positions of these (e, k, 3), the number of points of the
    mesh, and the words that errors begin with."""

    cell: str
    nodes: IntArray
    x: Array
    n_points: int
    where: str

    def field(self, name: str, value: Any, positions: Array) -> Array:
        """The field (e|1, q|1) at positions (q, 2) of the unit cell.

        Raises ValueError where it is not understood, has other sizes than the mesh, or is not finite.
        """
        if isinstance(value, int | float | np.floating) and not isinstance(value, bool):
            values = np.full((1, 1), float(value))
        elif isinstance(value, str):
            try:
                values = formula_of_position(value, np.matmul(CELL_TYPES[self.cell].interpolation(positions), self.x))
            except ValueError as error:
                raise ValueError(f"{self.where}: {name}: {error}") from None
        else:
            corner = CELL_TYPES[CELL_TYPES[self.cell].corner]
            values = self._at_corners(name, value) @ corner.interpolation(positions).T
        bad = np.argwhere(~np.isfinite(np.broadcast_to(values, (len(self.x), values.shape[1]))))
        if len(bad):
            raise ValueError(
                f"{self.where}: {name} is not finite in {self.element_text(int(bad[0, 0]))}; correct it there"
            )
        return values

    def element_text(self, element: int) -> str:
        """Number and position of an element, for errors."""
        return f"element {element} at ({', '.join(f'{c:.6g}' for c in self.x[element].mean(axis=0))}) m"

    def _at_corners(self, name: str, value: Any) -> Array:
        """Values (e, corners)."""
        corners = CELL_TYPES[self.cell].n_corners
        e = len(self.nodes)
        if isinstance(value, Mapping):
            kinds = [self.cell, *(["quad8"] if self.cell == "quad9" else [])]
            values_of_kind = next((value[kind] for kind in kinds if kind in value), None)
            array = None if values_of_kind is None else np.asarray(values_of_kind, float)
            if array is None or array.shape not in ((e,), (e, corners)):
                description = sorted(value) if array is None else array.shape
                raise ValueError(
                    f"{self.where}: {name} of {self.cell} elements is given as {description}; give one value for each "
                    f"of the {e} elements, or {corners} for their corners, by cell type"
                )
            return np.repeat(array[:, None], corners, axis=1) if array.ndim == 1 else array
        values = np.asarray(value, float) if np.ndim(value) == 1 else np.zeros(0)
        if not self.nodes[:, :corners].max() < len(values) <= self.n_points:  # members may have added middle nodes
            raise ValueError(
                f"{self.where}: {name} is {str(value)[:60]}; give a number, a formula of x, y and z, one value for "
                "each point of the mesh, or values by cell type"
            )
        return values[self.nodes[:, :corners]]


@dataclass(frozen=True, eq=False)
class VariableSection:
    """A plate section with fields: thickness [m] and density [kg/m^3] in place of its own, more mass per area [kg/m^2].

    section    not moved off the nodes;  offset  of its middle [m]
    thickness, density  None: those of the section
    """

    section: PlateSection
    offset: float
    thickness: Any = None
    density: Any = None
    extra_mass: Any = 0.0

    @property
    def varies(self) -> bool:
        """Whether anything is given as a field, or differs from the section."""
        return self.thickness is not None or self.density is not None or self.extra_mass != 0.0

    def heights(self, patch: Patch, positions: Array) -> Array:
        """Thicknesses (e|1, q|1) [m] at positions of elements; ValueError where one is not positive."""
        if self.thickness is None:
            return np.full((1, 1), self.section.thickness)
        return _positive(patch, "thickness", patch.field("thickness", self.thickness, positions), "m")

    def elastic(self, patch: Patch, positions: Array) -> Array:
        """[A B; B D] and S (e|1, q|1, 8, 8) over membrane strains, curvatures and shears, in the section's axes."""
        s, d = self.section, self.offset
        f = (self.heights(patch, positions) / s.thickness)[..., None, None]
        A, B, D = f * s.A, f**2 * s.B, f**3 * s.D
        C = np.zeros((*f.shape[:2], 8, 8))
        C[..., :3, :3], C[..., 3:6, 3:6], C[..., 6:, 6:] = A, D + 2 * d * B + d**2 * A, f * s.S
        C[..., :3, 3:6] = C[..., 3:6, :3] = B + d * A
        return C

    def plies(self, patch: Patch, positions: Array) -> Array:
        """Stress of plies (e|1, q|1, k, 2, 3, 6) [Pa, N/m] per strains in the section's axes, at positions."""
        return scaled_plies(self.section.plies, self.heights(patch, positions) / self.section.thickness, self.offset)

    def masses(self, patch: Patch, positions: Array) -> tuple[Array, Array, Array]:
        """Mass per area [kg/m^2], first [kg/m] and second moment [kg] about the surface of the nodes, (e|1, q|1)
        each."""
        s = self.section
        f = self.heights(patch, positions) / s.thickness
        structural, density_ratio = s.mass - s.added, np.ones((1, 1))
        if self.density is not None:
            if not structural > 0:
                raise ValueError(f"{patch.where} has a density and a section without mass; give its material a density")
            density_ratio = _positive(patch, "density", patch.field("density", self.density, positions), "kg/m^3")
            density_ratio = density_ratio * s.thickness / structural
        added = patch.field("extra_mass", self.extra_mass, positions)
        if (added < 0).any():
            element = int(np.argwhere(added < 0)[0, 0])
            raise ValueError(
                f"{patch.where}: extra_mass is {added.min():.6g} kg/m^2 in {patch.element_text(element)}; it is not "
                "negative"
            )
        m = structural * f * density_ratio + s.added + added
        c = s.centre * f + self.offset
        return m, m * c, s.rotary * f**3 * density_ratio + m * c**2


def _positive(patch: Patch, name: str, values: Array, unit: str) -> Array:
    if not (values > 0).all():
        element = int(np.argwhere(~(values > 0))[0, 0])
        raise ValueError(
            f"{patch.where}: {name} is {values.min():.6g} {unit} in {patch.element_text(element)}; it must be positive "
            "everywhere"
        )
    return values


def axes_at_nodes(axis_option: Any, angle: Any, patch: Patch, V: Array) -> Array:
    """Directions (3,) of the section's x axis, or at the nodes (e, k, 3): of three fields, and turned by an angle
    [rad] about the directors V (e, k, 3), towards V x axis."""
    nodes = CELL_TYPES[patch.cell].nodes
    if isinstance(axis_option, str) or any(isinstance(part, str | Mapping) for part in axis_option):
        if isinstance(axis_option, str) or len(axis_option) != 3:
            raise ValueError(
                f"{patch.where} has axis {axis_option!r}; give three numbers or three formulas of x, y and z"
            )
        parts = np.broadcast_arrays(*(patch.field("axis", part, nodes) for part in axis_option))
        axis = np.stack(parts, axis=-1)
    else:
        axis = np.asarray(axis_option, float)
        if axis.shape != (3,) or not np.isfinite(axis).all() or not axis.any():
            raise ValueError(f"{patch.where} has axis {axis_option!r}; give a direction of three numbers, not all zero")
        if isinstance(angle, int | float) and angle == 0:
            return axis
    angles = patch.field("angle", angle, nodes)[..., None]
    tangential = axis - np.sum(axis * V, axis=-1, keepdims=True) * V
    length = np.linalg.norm(tangential, axis=-1)
    if (flat := np.argwhere(length < 1e-6 * np.maximum(np.linalg.norm(axis, axis=-1), 1e-300))).size:
        raise ValueError(
            f"{patch.where}: axis is normal to the surface, or zero, in {patch.element_text(int(flat[0, 0]))}; give a "
            "direction that lies along the surface everywhere"
        )
    tangential = tangential / length[..., None]
    return np.asarray(np.cos(angles) * tangential + np.sin(angles) * np.cross(V, tangential))
