"""Sections by full 6 x 6 matrices, and materials and sections that name others: plies, solids, lay-ups of plates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, field_serializer, model_validator

from femflex.arrays import Array
from femflex.fem.sections.laminates import Lamina, PlateSection, Ply, layup
from femflex.fem.sections.library import (
    Box,
    CableSection,
    Circle,
    GivenSection,
    ISection,
    Rectangle,
    StiffnessSection,
    Tube,
)
from femflex.fem.sections.materials import Density, Material, Modulus, Orthotropic
from femflex.fem.sections.section import Outline, Resultants, ellipse
from femflex.noun.problems import suggestion_text
from femflex.noun.table import Table, refuse
from femflex.noun.values import Angle, PositiveLength, Quantity

SYMMETRIC = 1e-6  # of the largest entry, by which a matrix may differ from its transpose


class FullSection(Table):
    """A beam by full 6 x 6 stiffness and mass per length about its node line, such as a composite blade."""

    kind: Literal["full"] = "full"
    """Selects this section: by full matrices."""
    stiffness: Annotated[Array, Quantity("", (6, 6))]
    """Stiffness in SI over axial strain, shear strains along y and z, twist rate, curvatures about y and z."""
    mass: Annotated[Array, Quantity("", (6, 6))]
    """Mass per length in SI over velocities along x, y, z and rates about x, y, z."""
    radius: PositiveLength | None = None
    """Radius of the round bar that is drawn. Default: an ellipse with the stiffness's radii of gyration."""

    __eq__, __hash__ = object.__eq__, object.__hash__  # by identity: its values are arrays

    @model_validator(mode="after")
    def _matrices_fit(self) -> FullSection:
        for name in ("stiffness", "mass"):
            K = np.asarray(getattr(self, name), float)
            if np.abs(K - K.T).max() > SYMMETRIC * np.abs(K).max():
                refuse(f"{name} of a full section is not symmetric; give the matrix about one point")
            vars(self)[name] = (K + K.T) / 2
        if not np.linalg.eigvalsh(self._scaled())[0] > 0:
            refuse(
                "stiffness of a full section is not positive definite: the strain energy must be positive in "
                "every strain"
            )
        M = np.asarray(self.mass, float)
        if not M[0, 0] > 0 or np.abs(M[[1, 2], [1, 2]] - M[0, 0]).max() > SYMMETRIC * M[0, 0]:
            refuse(
                f"mass of a full section has {np.diag(M)[:3].tolist()} kg/m on its diagonal; these must be equal and "
                "positive"
            )
        y, z, yy, zz, yz = self._moments()
        if min(yy - y * y, zz - z * z) < 0 or (yy - y * y) * (zz - z * z) < (yz - y * z) ** 2:
            refuse("mass of a full section has moments of inertia that no distribution of mass has")
        return self

    @field_serializer("stiffness", "mass")
    def _listed(self, value: Array) -> Any:
        return value.tolist()

    @property
    def couples_shear(self) -> bool:
        """Whether the beam shears where its options do not say."""
        return True

    @property
    def varies(self) -> bool:
        """Whether anything changes along the member."""
        return False

    def resultants(self, material: Material | None, s: Array, length: Array | float) -> Resultants:
        """Stiffness and mass per length as `Resultants`, in SI; the material, if any, is not used."""
        K, M = np.asarray(self.stiffness, float), np.asarray(self.mass, float)
        ones = np.ones(np.shape(s))
        EA, GAy, GAz, GJ, EIy, EIz = (value * ones for value in np.diag(K))
        y, z, yy, zz, yz = self._moments()
        return Resultants(
            EA, GJ, EIy, EIz, M[0, 0] * ones, (zz - z * z) * ones, (yy - y * y) * ones, (EIy + EIz) / EA, GAy, GAz,
            coupled=np.broadcast_to(K, (*np.shape(s), 6, 6)),
            centre=np.broadcast_to([y, z], (*np.shape(s), 2)),
            product=(yz - y * z) * ones,
        )  # fmt: skip

    def outline(self, s: Array, length: Array | float) -> Outline:
        """Polygon of the section (..., k, 2) [m] at s."""
        K = np.asarray(self.stiffness, float)
        ones = np.ones(np.shape(s))
        if self.radius is not None:
            return ellipse(self.radius * ones, self.radius * ones)
        return ellipse(2 * np.sqrt(K[5, 5] / K[0, 0]) * ones, 2 * np.sqrt(K[4, 4] / K[0, 0]) * ones)

    def _moments(self) -> tuple[float, float, float, float, float]:
        """y and z of the mass centre, means of y^2, z^2 and y z over the mass, about the node line."""
        M = np.asarray(self.mass, float)
        m = M[0, 0]
        return -M[0, 5] / m, M[0, 4] / m, M[5, 5] / m, M[4, 4] / m, -M[4, 5] / m

    def _scaled(self) -> Array:
        K = np.asarray(self.stiffness, float)
        size = np.sqrt(np.maximum(np.diag(K), 0.0))
        return K / np.where(size > 0, size, 1.0) / np.where(size > 0, size, 1.0)[:, None]


MassPerArea = Annotated[float, Quantity("kg/m^2", least=0.0)]


class CoreMaterial(Table):
    """A honeycomb or foam core that carries transverse shear only."""

    kind: Literal["core"] = "core"
    """Selects this material: a core that carries transverse shear only."""
    density: Density
    """Mass per volume."""
    G13: Modulus
    """Transverse shear modulus in the 1-3 plane."""
    G23: Modulus | None = None
    """Transverse shear modulus in the 2-3 plane. Default: G13."""

    @property
    def lamina(self) -> Lamina:
        """The material of a ply."""
        return Lamina.core(self.density, self.G13, self.G23)


NamedMaterial = Annotated[
    Annotated[Material | Lamina | CoreMaterial, Field(discriminator="kind")],
    BeforeValidator(lambda value: {"kind": "isotropic", **value} if isinstance(value, dict) else value),
]
Materials = Mapping[str, NamedMaterial]


class PlateTable(Table):
    """A sheet of the member's material, isotropic or orthotropic."""

    kind: Literal["plate"] = "plate"
    """Selects this section: a sheet of the member's material."""
    thickness: PositiveLength
    """Thickness of the sheet."""
    angle: Angle = 0.0
    """Angle of the material's axis 1 from the plate's x axis."""
    extra_mass: MassPerArea = 0.0
    """Non-structural mass per area, such as cells and wiring."""

    def plies_of(self, material: Material | Lamina | None, materials: Materials) -> list[Ply]:
        """The one ply, of the member's material. Raises ValueError without one."""
        if material is None:
            raise ValueError("a section of kind 'plate' takes the member's material; name one in `material`")
        return [Ply(as_lamina(material), self.thickness, self.angle)]


class PlyTable(Table):
    """A layer of one material."""

    material: str
    """Name in [materials]."""
    thickness: PositiveLength
    """Thickness of the layer."""
    angle: Angle = 0.0
    """Angle of the material's axis 1 from the plate's x axis."""

    def ply(self, materials: Materials) -> Ply:
        """The Ply. Raises ValueError where its material is not among the materials."""
        if self.material not in materials:
            raise ValueError(
                f"found material = {self.material!r} of a layer, which is not in [materials]; "
                f"{suggestion_text(self.material, materials)}"
            )
        return Ply(as_lamina(member_material(materials[self.material])), self.thickness, self.angle)


class SandwichTable(Table):
    """Two equal faces on a core; the member needs no material."""

    kind: Literal["sandwich"] = "sandwich"
    """Selects this section: two equal faces on a core."""
    face: PlyTable
    """Layer of each face."""
    core: PlyTable
    """Layer of the core."""
    extra_mass: MassPerArea = 0.0
    """Non-structural mass per area, such as cells and wiring."""

    def plies_of(self, material: Material | Lamina | None, materials: Materials) -> list[Ply]:
        """Face, core and face."""
        return [layer.ply(materials) for layer in (self.face, self.core, self.face)]


class LayupTable(Table):
    """A stack of plies from the bottom to the top; the member needs no material. For plates it is symmetric about its
    middle."""

    kind: Literal["layup"] = "layup"
    """Selects this section: a stack of plies."""
    plies: Annotated[list[PlyTable], Field(min_length=1)]
    """Plies from the bottom to the top."""
    extra_mass: MassPerArea = 0.0
    """Non-structural mass per area, such as cells and wiring."""

    def plies_of(self, material: Material | Lamina | None, materials: Materials) -> list[Ply]:
        """The plies, from the bottom."""
        return [layer.ply(materials) for layer in self.plies]


BeamSection = Tube | Circle | Box | Rectangle | ISection | GivenSection | StiffnessSection | FullSection | CableSection
NamedSection = Annotated[BeamSection | PlateTable | SandwichTable | LayupTable, Field(discriminator="kind")]


def member_material(material: NamedMaterial) -> Material | Lamina:
    """The material of beams and plies: isotropic, or the Lamina of an orthotropic material or a core."""
    return material.lamina if isinstance(material, CoreMaterial) else material


def solid_material(material: NamedMaterial) -> Material | Orthotropic:
    """The material of a solid. Raises ValueError for a core, and for an orthotropic material without its third axis."""
    if isinstance(material, CoreMaterial):
        raise ValueError("found a core; solids take an isotropic or an orthotropic material")
    return material if isinstance(material, Material) else material.solid


def member_section(
    section: NamedSection, material: Material | Lamina | None, materials: Materials, coupled: bool = False
) -> tuple[BeamSection | PlateSection, Material | None]:
    """The section of a member and its material; the material is None for plates, whose section contains it.

    Raises ValueError if the section does not fit the member's material.
    """
    if isinstance(section, PlateTable | SandwichTable | LayupTable):
        return layup(section.plies_of(material, materials), coupled, section.extra_mass), None
    if isinstance(material, Lamina):
        raise ValueError("a beam section takes an isotropic material; this one is orthotropic or a core")
    return section, material


def as_lamina(material: Material | Lamina) -> Lamina:
    """The Lamina of a material."""
    return Lamina.isotropic(material) if isinstance(material, Material) else material
