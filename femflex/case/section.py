"""[materials.<name>] and [sections.<name>]: what members are made of and how thick they are."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from femflex.case.base import Table
from femflex.case.values import Along, Angle, Plain, PositiveLength, Quantity

Modulus = Annotated[float, Quantity("Pa", above=0.0)]
Density = Annotated[float, Quantity("kg/m^3", least=0.0)]
Poisson = Annotated[float, Quantity("", above=-1.0, below=0.5)]
MassPerArea = Annotated[float, Quantity("kg/m^2", least=0.0)]
Variable = float | str | tuple[tuple[float, ...], tuple[float, ...]]
LengthAlong = Annotated[Variable, Along("m")]
AreaAlong = Annotated[Variable, Along("m^2")]
SecondMomentAlong = Annotated[Variable, Along("m^4")]
RigidityAlong = Annotated[Variable, Along("N m^2")]


class Isotropic(Table):
    """An isotropic linear elastic material."""

    kind: Literal["isotropic"] = "isotropic"
    E: Modulus
    """Young's modulus."""
    nu: Poisson = 0.3
    density: Density
    G: Modulus | None = None
    """Shear modulus; left out, E / 2(1 + nu)."""


class Orthotropic(Table):
    """A material of plies: axes 1 and 2 in the plane."""

    kind: Literal["orthotropic"]
    E1: Modulus
    E2: Modulus
    G12: Modulus
    nu12: Plain
    """Pull along 1, contraction along 2."""
    density: Density
    G13: Modulus | None = None
    """Transverse shear modulus; left out, G12."""
    G23: Modulus | None = None


class Core(Table):
    """A honeycomb or foam core that carries transverse shear only."""

    kind: Literal["core"]
    density: Density
    G13: Modulus
    G23: Modulus | None = None
    """Left out, G13."""


class Tube(Table):
    """Round tube."""

    kind: Literal["tube"]
    outer_radius: LengthAlong
    thickness: LengthAlong
    """Of the wall."""


class Circle(Table):
    """Solid round bar."""

    kind: Literal["circle"]
    radius: LengthAlong


class Box(Table):
    """Hollow rectangle: width along the section's y, height along its z."""

    kind: Literal["box"]
    width: LengthAlong
    height: LengthAlong
    thickness: LengthAlong


class Rectangle(Table):
    """Solid rectangle: width along the section's y, height along its z."""

    kind: Literal["rectangle"]
    width: LengthAlong
    height: LengthAlong


class ISection(Table):
    """Doubly symmetric I: flanges along y, web along z."""

    kind: Literal["I"]
    width: LengthAlong
    height: LengthAlong
    flange: LengthAlong
    """Thickness of the flanges."""
    web: LengthAlong
    """Thickness of the web."""


class Given(Table):
    """A beam section by area and second moments; Iy bends in x-z, Iz in x-y."""

    kind: Literal["numbers"]
    A: AreaAlong
    Iy: SecondMomentAlong
    Iz: SecondMomentAlong
    J: SecondMomentAlong
    y_max: LengthAlong | None = None
    z_max: LengthAlong | None = None


class Stiffness(Table):
    """A beam by its stiffness and mass per length; needs no material."""

    kind: Literal["stiffness"]
    EA: Annotated[Variable, Along("N")]
    EIy: RigidityAlong
    EIz: RigidityAlong
    GJ: RigidityAlong
    mass_per_length: Annotated[Variable, Along("kg/m")]
    ry: LengthAlong | None = None
    """Radius of gyration of the mass, root of int z^2 dm over the mass."""
    rz: LengthAlong | None = None
    area: AreaAlong | None = None
    """Of the round bar that is drawn; left out, an ellipse of the stiffness's radii of gyration."""


class Plate(Table):
    """A sheet of the member's material, isotropic or orthotropic."""

    kind: Literal["plate"]
    thickness: PositiveLength
    angle: Angle = 0.0
    """Of an orthotropic material's axis 1 from the plate's x axis."""
    extra_mass: MassPerArea = 0.0
    """Mass per area that is no structure (cells, wiring)."""


class PlyTable(Table):
    """A layer of one material."""

    material: str
    """Name in [materials]."""
    thickness: PositiveLength
    angle: Angle = 0.0
    """Of the material's axis 1 from the plate's x axis."""


class Sandwich(Table):
    """Two equal faces on a core; the member needs no material."""

    kind: Literal["sandwich"]
    face: PlyTable
    core: PlyTable
    extra_mass: MassPerArea = 0.0


class Layup(Table):
    """A stack of plies from the bottom to the top, symmetric about its middle; the member needs no material."""

    kind: Literal["layup"]
    plies: Annotated[list[PlyTable], Field(min_length=1)]
    extra_mass: MassPerArea = 0.0


def _isotropic_unless_said(value: Any) -> Any:
    return {"kind": "isotropic", **value} if isinstance(value, dict) else value


Material = Annotated[
    Annotated[Isotropic | Orthotropic | Core, Field(discriminator="kind")], BeforeValidator(_isotropic_unless_said)
]
Section = Annotated[
    Tube | Circle | Box | Rectangle | ISection | Given | Stiffness | Plate | Sandwich | Layup,
    Field(discriminator="kind"),
]
