"""[materials.<name>] and [sections.<name>]: materials, and cross-sections or thicknesses of members."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from femflex.noun.table import Table
from femflex.noun.values import AlongMember, Angle, Plain, PositiveLength, Quantity

Modulus = Annotated[float, Quantity("Pa", above=0.0)]
Density = Annotated[float, Quantity("kg/m^3", least=0.0)]
Poisson = Annotated[float, Quantity("", above=-1.0, below=0.5)]
MassPerArea = Annotated[float, Quantity("kg/m^2", least=0.0)]
Variable = float | str | tuple[tuple[float, ...], tuple[float, ...]]
LengthAlong = Annotated[Variable, AlongMember("m")]
AreaAlong = Annotated[Variable, AlongMember("m^2")]
SecondMomentAlong = Annotated[Variable, AlongMember("m^4")]
RigidityAlong = Annotated[Variable, AlongMember("N m^2")]


class Isotropic(Table):
    """An isotropic linear elastic material."""

    kind: Literal["isotropic"] = "isotropic"
    """Selects this material: isotropic."""
    E: Modulus
    """Elastic (Young's) modulus."""
    nu: Poisson = 0.3
    """Poisson's ratio."""
    density: Density
    """Mass per volume."""
    G: Modulus | None = None
    """Shear modulus. Default: E / 2(1 + nu)."""


class Orthotropic(Table):
    """A material with axes of its own: of plies, with axes 1 and 2 in the plane, or of solids."""

    kind: Literal["orthotropic"]
    """Selects this material: orthotropic, for plies and solids."""
    E1: Modulus
    """Elastic modulus along axis 1."""
    E2: Modulus
    """Elastic modulus along axis 2."""
    G12: Modulus
    """In-plane shear modulus."""
    nu12: Plain
    """Poisson's ratio: contraction along 2 under tension along 1."""
    density: Density
    """Mass per volume."""
    G13: Modulus | None = None
    """Transverse shear modulus in the 1-3 plane. Default: G12."""
    G23: Modulus | None = None
    """Transverse shear modulus in the 2-3 plane. Default: G12."""
    E3: Modulus | None = None
    """Elastic modulus along axis 3, which solids need."""
    nu13: Plain | None = None
    """Poisson's ratio, which solids need: contraction along 3 under tension along 1."""
    nu23: Plain | None = None
    """Poisson's ratio, which solids need: contraction along 3 under tension along 2."""


class Core(Table):
    """A honeycomb or foam core that carries transverse shear only."""

    kind: Literal["core"]
    """Selects this material: a core that carries transverse shear only."""
    density: Density
    """Mass per volume."""
    G13: Modulus
    """Transverse shear modulus in the 1-3 plane."""
    G23: Modulus | None = None
    """Transverse shear modulus in the 2-3 plane. Default: G13."""


class Tube(Table):
    """Round tube."""

    kind: Literal["tube"]
    """Selects this section: a round tube."""
    outer_radius: LengthAlong
    """Outer radius."""
    thickness: LengthAlong
    """Thickness of the wall."""


class Circle(Table):
    """Solid round bar."""

    kind: Literal["circle"]
    """Selects this section: a solid round bar."""
    radius: LengthAlong
    """Outer radius."""


class Box(Table):
    """Hollow rectangle: width along the section's y, height along its z."""

    kind: Literal["box"]
    """Selects this section: a hollow rectangle."""
    width: LengthAlong
    """Outer width along the section's y axis."""
    height: LengthAlong
    """Outer height along the section's z axis."""
    thickness: LengthAlong
    """Thickness of the walls."""


class Rectangle(Table):
    """Solid rectangle: width along the section's y, height along its z."""

    kind: Literal["rectangle"]
    """Selects this section: a solid rectangle."""
    width: LengthAlong
    """Outer width along the section's y axis."""
    height: LengthAlong
    """Outer height along the section's z axis."""


class ISection(Table):
    """Doubly symmetric I: flanges along y, web along z."""

    kind: Literal["I"]
    """Selects this section: a doubly symmetric I."""
    width: LengthAlong
    """Outer width along the section's y axis."""
    height: LengthAlong
    """Outer height along the section's z axis."""
    flange: LengthAlong
    """Thickness of the flanges."""
    web: LengthAlong
    """Thickness of the web."""


class NumberSection(Table):
    """A beam section by area and second moments; Iy bends in x-z, Iz in x-y."""

    kind: Literal["numbers"]
    """Selects this section: by its numbers."""
    A: AreaAlong
    """Area of the section."""
    Iy: SecondMomentAlong
    """Second moment of area about y; it bends in the x-z plane."""
    Iz: SecondMomentAlong
    """Second moment of area about z; it bends in the x-y plane."""
    J: SecondMomentAlong
    """Torsion constant."""
    y_max: LengthAlong | None = None
    """Largest distance of a fibre along y, for stresses and pictures. Default: that of an ellipse of the same A and
    Iz."""
    z_max: LengthAlong | None = None
    """Largest distance of a fibre along z, for stresses and pictures. Default: that of an ellipse of the same A and
    Iy."""


class Stiffness(Table):
    """A beam by its stiffness and mass per length; needs no material."""

    kind: Literal["stiffness"]
    """Selects this section: by its stiffnesses."""
    EA: Annotated[Variable, AlongMember("N")]
    """Axial stiffness."""
    EIy: RigidityAlong
    """Bending stiffness in the x-z plane."""
    EIz: RigidityAlong
    """Bending stiffness in the x-y plane."""
    GJ: RigidityAlong
    """Torsional stiffness."""
    mass_per_length: Annotated[Variable, AlongMember("kg/m")]
    """Mass per length."""
    ry: LengthAlong | None = None
    """Radius of gyration of the mass about y: root of int z^2 dm over the mass."""
    rz: LengthAlong | None = None
    """Radius of gyration of the mass about z: root of int y^2 dm over the mass."""
    area: AreaAlong | None = None
    """Area of the round bar that is drawn. Default: an ellipse with the stiffnesses' radii of gyration."""
    GAy: Annotated[Variable, AlongMember("N")] | None = None
    """Shear stiffness along y, shear factor included. Needed where the beam shears."""
    GAz: Annotated[Variable, AlongMember("N")] | None = None
    """Shear stiffness along z, shear factor included. Needed where the beam shears."""


class MatrixSection(Table):
    """A beam by full 6 x 6 stiffness and mass per length about its node line, such as a composite blade."""

    kind: Literal["full"]
    """Selects this section: by full matrices."""
    stiffness: Annotated[tuple[tuple[float, ...], ...], Quantity("", (6, 6))]
    """Stiffness in SI over axial strain, shear strains along y and z, twist rate, curvatures about y and z."""
    mass: Annotated[tuple[tuple[float, ...], ...], Quantity("", (6, 6))]
    """Mass per length in SI over velocities along x, y, z and rates about x, y, z."""
    radius: PositiveLength | None = None
    """Radius of the round bar that is drawn. Default: an ellipse with the stiffness's radii of gyration."""


class Cable(Table):
    """A cable, string or tether: axial stiffness and mass alone; the member needs no material."""

    kind: Literal["cable"]
    """Selects this section: axial stiffness and mass per length, for tethers."""
    EA: Annotated[Variable, AlongMember("N")]
    """Axial stiffness."""
    mass_per_length: Annotated[Variable, AlongMember("kg/m")]
    """Mass per length."""


class Plate(Table):
    """A sheet of the member's material, isotropic or orthotropic."""

    kind: Literal["plate"]
    """Selects this section: a sheet of the member's material."""
    thickness: PositiveLength
    """Thickness of the sheet."""
    angle: Angle = 0.0
    """Angle of the material's axis 1 from the plate's x axis."""
    extra_mass: MassPerArea = 0.0
    """Non-structural mass per area, such as cells and wiring."""


class PlyTable(Table):
    """A layer of one material."""

    material: str
    """Name in [materials]."""
    thickness: PositiveLength
    """Thickness of the layer."""
    angle: Angle = 0.0
    """Angle of the material's axis 1 from the plate's x axis."""


class Sandwich(Table):
    """Two equal faces on a core; the member needs no material."""

    kind: Literal["sandwich"]
    """Selects this section: two equal faces on a core."""
    face: PlyTable
    """Layer of each face."""
    core: PlyTable
    """Layer of the core."""
    extra_mass: MassPerArea = 0.0
    """Non-structural mass per area, such as cells and wiring."""


class Layup(Table):
    """A stack of plies from the bottom to the top; the member needs no material. For plates it is symmetric about its
    middle."""

    kind: Literal["layup"]
    """Selects this section: a stack of plies."""
    plies: Annotated[list[PlyTable], Field(min_length=1)]
    """Plies from the bottom to the top."""
    extra_mass: MassPerArea = 0.0
    """Non-structural mass per area, such as cells and wiring."""


def _isotropic_by_default(value: Any) -> Any:
    return {"kind": "isotropic", **value} if isinstance(value, dict) else value


Material = Annotated[
    Annotated[Isotropic | Orthotropic | Core, Field(discriminator="kind")], BeforeValidator(_isotropic_by_default)
]
Section = Annotated[
    Tube
    | Circle
    | Box
    | Rectangle
    | ISection
    | NumberSection
    | Stiffness
    | MatrixSection
    | Cable
    | Plate
    | Sandwich
    | Layup,
    Field(discriminator="kind"),
]
