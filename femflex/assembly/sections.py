"""Build the materials and sections of a case."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from femflex.case import section as tables
from femflex.fem.sections import (
    Box,
    CableSection,
    Circle,
    FullSection,
    GivenSection,
    ISection,
    Rectangle,
    StiffnessSection,
    Tube,
)
from femflex.fem.sections.laminates import Lamina, PlateSection, Ply, layup
from femflex.fem.sections.materials import Material, Orthotropic
from femflex.noun.problems import suggestion_text
from femflex.noun.table import Table

BEAM_SECTIONS: dict[type[Table], Any] = {
    tables.Tube: Tube,
    tables.Circle: Circle,
    tables.Box: Box,
    tables.Rectangle: Rectangle,
    tables.ISection: ISection,
    tables.NumberSection: GivenSection,
    tables.Stiffness: StiffnessSection,
    tables.MatrixSection: FullSection,
    tables.Cable: CableSection,
}


def build_material(table: tables.Material) -> Material | Lamina:
    """The isotropic Material, or the Lamina of an orthotropic or core material."""
    values = table.model_dump(exclude={"kind", "E3", "nu13", "nu23"}, exclude_none=True)
    if isinstance(table, tables.Isotropic):
        return Material(**values)
    return Lamina.core(**values) if isinstance(table, tables.Core) else Lamina(**values)


def build_solid_material(table: tables.Material) -> Material | Orthotropic:
    """The material of a solid. Raises ValueError for a core, and for an orthotropic material without its third axis."""
    if isinstance(table, tables.Isotropic):
        return Material(**table.model_dump(exclude={"kind"}, exclude_none=True))
    if isinstance(table, tables.Core):
        raise ValueError("found a core; solids take an isotropic or an orthotropic material")
    missing = [name for name in ("E3", "nu13", "nu23") if getattr(table, name) is None]
    if missing:
        raise ValueError(f"found an orthotropic material without {', '.join(missing)}, which solids need; add them")
    G13, G23 = (table.G12 if modulus is None else modulus for modulus in (table.G13, table.G23))
    assert table.E3 is not None and table.nu13 is not None and table.nu23 is not None
    return Orthotropic(
        table.E1, table.E2, table.E3, table.G12, G13, G23, table.nu12, table.nu13, table.nu23, table.density
    )


def build_section(
    table: tables.Section,
    material: Material | Lamina | None,
    materials: Mapping[str, tables.Material],
    coupled: bool = False,
) -> tuple[Any, Material | None]:
    """The section of a member and its material; the material is None for plates, whose section contains it.

    Raises ValueError if the section does not fit the member's material.
    """
    kind = type(table)
    if kind in BEAM_SECTIONS:
        if isinstance(material, Lamina):
            raise ValueError("a beam section takes an isotropic material; this one is orthotropic or a core")
        values = table.model_dump(exclude={"kind"}, exclude_none=True)
        return BEAM_SECTIONS[kind](**values), material
    return _plate_section(table, material, materials, coupled), None


def _plate_section(
    table: tables.Section,
    material: Material | Lamina | None,
    materials: Mapping[str, tables.Material],
    coupled: bool,
) -> PlateSection:
    if isinstance(table, tables.Plate):
        if material is None:
            raise ValueError("a section of kind 'plate' takes the member's material; name one in `material`")
        plies = [Ply(_lamina(material), table.thickness, table.angle)]
    else:
        layers = table.plies if isinstance(table, tables.Layup) else [table.face, table.core, table.face]  # type: ignore[union-attr]
        plies = [_ply(layer, materials) for layer in layers]
    return layup(plies, coupled, table.extra_mass)  # type: ignore[union-attr]


def _ply(table: tables.PlyTable, materials: Mapping[str, tables.Material]) -> Ply:
    if table.material not in materials:
        raise ValueError(
            f"found material = {table.material!r} of a layer, which is not in [materials]; "
            f"{suggestion_text(table.material, materials)}"
        )
    return Ply(_lamina(build_material(materials[table.material])), table.thickness, table.angle)


def _lamina(material: Material | Lamina) -> Lamina:
    return Lamina.isotropic(material) if isinstance(material, Material) else material
