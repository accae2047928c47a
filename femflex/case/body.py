"""[bodies.<name>]: rigid, meshed, analytic, or read from the file of a reduced body."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, StrictBool, ValidationInfo, field_validator, model_validator

from femflex.case.base import Name, Table, exactly_one, refuse
from femflex.case.inertia import InertiaMatrix
from femflex.case.initial import InitialTable
from femflex.case.options import add_options, read_options
from femflex.case.reduction import DampingTable, FunctionsTable, Reduction
from femflex.case.shape import MarkerTable, Shape
from femflex.case.values import Count, Direction, Mass, Position, PositiveLength, Quantity

Strain = Literal["linear", "nonlinear", "condensed"]


class BodyTable(Table):
    """What every body may say."""

    markers: dict[Name, MarkerTable] = Field(default_factory=dict)
    initial: InitialTable | None = None

    def own_markers(self) -> tuple[str, ...]:
        """Names of markers the body has without being told."""
        return ("origin",)


class RigidTable(BodyTable):
    """A rigid body."""

    kind: Literal["rigid"]
    mass: Mass
    inertia: InertiaMatrix
    """Three principal moments or a 3 x 3 matrix, about the centre of mass, body axes."""
    center_of_mass: Position = (0.0, 0.0, 0.0)
    inertia_about: Literal["center_of_mass", "origin"] = "center_of_mass"
    shapes: list[Shape] = Field(default_factory=list)
    """What is drawn; left out, a box with this mass and inertia."""

    @model_validator(mode="after")
    def _rigid_only(self) -> RigidTable:
        if self.initial is not None:
            refuse(
                "found initial on a rigid body, which has no elastic coordinates; joints and [attitude] set its motion"
            )
        for name, marker in self.markers.items():
            if marker.group is not None:
                refuse(f"found group in marker {name!r} of a rigid body, which has no mesh; give position")
        return self


class MemberTable(Table):
    """A mesh group that becomes structure."""

    group: str
    model_config = ConfigDict(json_schema_extra=add_options)

    family: str
    """beam, plate, ...: this schema and the README list them with their options."""
    section: str | None = None
    """Name in [sections]."""
    material: str | None = None
    """Name in [materials]."""
    options: dict[str, Any] = Field(default_factory=dict)
    """What the family lets choose: order of a beam, prestress, thermal strain, ..."""
    segments: Annotated[int, Count(1)] | None = None
    """Cut this line into so many bodies welded end to end, so that it may bend as far as it likes."""

    @field_validator("options", mode="after")
    @classmethod
    def _in_si(cls, options: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        return read_options(info.data.get("family", ""), options)


class PointMassTable(Table):
    """A concentrated mass at every point of a mesh group."""

    group: str
    mass: Mass
    inertia: InertiaMatrix | None = None
    offset: Position = (0.0, 0.0, 0.0)
    """Of the mass's centre from the node."""


class FlexibleTable(BodyTable):
    """A body made of finite elements on a mesh; the body frame is the mesh's coordinates."""

    kind: Literal["flexible"]
    mesh: str
    """Mesh file, relative to the case file."""
    mesh_unit: Literal["m", "mm", "cm", "inch"] = "m"
    """Unit of the mesh file's coordinates."""
    refine: Annotated[int, Count(0)] = 0
    """How often every cell is divided in two along each edge."""
    groups: dict[Name, str] = Field(default_factory=dict)
    """Wanted name -> name in the file, where a format knows numbers only: panel = "PID 1", root = "SET 4" (Nastran)."""
    members: Annotated[list[MemberTable], Field(min_length=1)]
    point_masses: list[PointMassTable] = Field(default_factory=list)
    reduction: Reduction | None = None
    """Left out only with segments: static shapes of each, and no modes between its ends."""
    strain: Strain | None = None
    """linear: small motions; bending does not stretch, and a spin does not stiffen. nonlinear: the cubic and quartic
    terms of the strain energy (V2, V3), with coordinates for the stretch; wants derivatives. condensed: the same with
    the stretch following the bending, so that no stiff coordinate is left. Left out: condensed where the motion that is
    foreseen asks for it (spin, loads, weight, specified motions, initial bends, nearness to buckling), nonlinear where
    the body cannot be condensed, else linear; every verb that builds the body says which and why."""
    damping: DampingTable | None = None

    @property
    def cut(self) -> MemberTable | None:
        """The member that is cut into segments, if one is."""
        return next((member for member in self.members if member.segments is not None), None)

    @model_validator(mode="after")
    def _reduced_or_cut(self) -> FlexibleTable:
        several = [member.group for member in self.members if member.segments is not None]
        if len(several) > 1:
            refuse(f"found segments in the members on {', '.join(several)}; one line of a body can be cut")
        method = getattr(self.reduction, "method", None)
        if not several and method is None:
            refuse("found no reduction; give one, such as { method = 'cantilever', clamp = 'root', modes = 8 }")
        if not several and method == "craig_bampton" and not getattr(self.reduction, "interfaces", ()):
            refuse("found craig_bampton without interfaces; name the groups that joints hold")
        if several and method in ("lumped", "rigid"):
            refuse(
                f"found reduction method '{method}' and segments; a segment is reduced by craig_bampton, cantilever, "
                f"free_free or nodal"
            )
        if several and getattr(self.reduction, "loads", None):
            refuse(
                "found loads in the reduction of a body cut into segments; a segment's ends carry all loads, so drop it"
            )
        if getattr(self.reduction, "third_derivatives", 0) and (several or self.strain == "linear"):
            what = "cut into segments" if several else "with linear strain"
            refuse(f"found third_derivatives in the reduction of a body {what}, which has no use for them; drop them")
        if getattr(self.reduction, "responses", 0) and (several or self.strain != "nonlinear"):
            what = "a body cut into segments" if several else f"a body with strain = {self.strain!r}"
            refuse(f"found responses in the reduction of {what}; they are for strain = 'nonlinear' of a whole body")
        if several and self.initial is not None:
            refuse("found initial on a body cut into segments; start from an equilibrium instead ([initial] from)")
        if several and self.damping is not None and (self.damping.ratio is not None or self.damping.mass):
            refuse(
                "found damping by ratio or mass on a body cut into segments, whose own modes are not those of the "
                "whole; give damping = { stiffness = ... }, which damps strain wherever it is"
            )
        return self

    @model_validator(mode="after")
    def _markers_have_place(self) -> FlexibleTable:
        for name, marker in self.markers.items():
            if marker.group is not None and marker.position is not None:
                refuse(f"found group and position in marker {name!r}; give one of them")
        return self


class AnalyticTable(BodyTable):
    """A straight uniform beam on admissible functions, with markers root and tip; no mesh."""

    kind: Literal["analytic"]
    length: PositiveLength
    EA: Annotated[float, Quantity("N", above=0.0)]
    EIy: Annotated[float, Quantity("N m^2", above=0.0)]
    """Bends in x-z."""
    EIz: Annotated[float, Quantity("N m^2", above=0.0)]
    """Bends in x-y."""
    GJ: Annotated[float, Quantity("N m^2", above=0.0)]
    mass: Mass | None = None
    """Of the whole beam, instead of mass_per_length."""
    mass_per_length: Annotated[float, Quantity("kg/m", above=0.0)] | None = None
    ry: Annotated[float, Quantity("m", least=0.0)] = 0.0
    """Radius of gyration of the section's mass, root of int z^2 dm over the mass."""
    rz: Annotated[float, Quantity("m", least=0.0)] = 0.0
    rotary_inertia: StrictBool = True
    root: Position = (0.0, 0.0, 0.0)
    """Where the beam starts."""
    direction: Direction = (1.0, 0.0, 0.0)
    """Where it points."""
    orientation: Direction | None = None
    """A vector near the section's y axis."""
    far_bends: StrictBool | None = None
    """Nonlinear strain that stays bounded where a flat section bends far about its weak axis and twists, at the cost of
    what a twist takes from bends in the stiff plane: a strip tips over 1 / (2 EIy / EIz) late. Left out: true."""
    radius: PositiveLength | None = None
    """Of the tube that is drawn; left out, a line."""
    functions: FunctionsTable
    strain: Strain | None = None
    """As for meshed bodies; nonlinear wants axial functions, beside which the rest of the stretch follows; condensed
    brings its own."""
    damping: DampingTable | None = None

    @model_validator(mode="after")
    def _one_mass(self) -> AnalyticTable:
        exactly_one(self, ("mass", "mass_per_length"))
        return self

    def own_markers(self) -> tuple[str, ...]:
        """The beam's two ends."""
        return ("origin", "root", "tip")


class FileTable(BodyTable):
    """A reduced body saved by `femflex body`."""

    kind: Literal["file"]
    file: str
    """Relative to the case file."""
    modes: Annotated[int, Count(0)] | None = None
    """Keep only the first so many elastic coordinates."""
    damping: DampingTable | None = None


Body = Annotated[RigidTable | FlexibleTable | AnalyticTable | FileTable, Field(discriminator="kind")]
