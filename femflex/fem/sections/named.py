"""Materials and sections that name others: materials of plies and of solids, and lay-ups of plates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from femflex.fem.sections.full import FullSection
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
from femflex.noun.problems import suggestion_text
from femflex.noun.table import Table
from femflex.noun.values import Angle, PositiveLength, Quantity

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


def _isotropic_by_default(value: Any) -> Any:
    return {"kind": "isotropic", **value} if isinstance(value, dict) else value


NamedMaterial = Annotated[
    Annotated[Material | Lamina | CoreMaterial, Field(discriminator="kind")],
    BeforeValidator(_isotropic_by_default),
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
