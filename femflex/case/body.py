"""[bodies.<name>]: rigid, meshed, analytic, or read from the file of a reduced body."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, model_validator

from femflex.case.base import Name, Orientation, Table, exactly_one, refuse
from femflex.case.values import (
    Count,
    Direction,
    Mass,
    Matrix,
    Position,
    PositiveLength,
    Quantity,
    ValueProblem,
    Whole,
    _Readable,
    shown,
)

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")


class _ClampValue(_Readable):
    """Group names, or group name -> components held. Reads into a dict; an empty tuple of components holds all six."""

    def read(self, value: Any) -> dict[str, tuple[str, ...]]:
        """Group -> components held."""
        if isinstance(value, str):
            value = [value]
        if isinstance(value, list) and all(isinstance(name, str) for name in value):
            return dict.fromkeys(value, ())
        if not isinstance(value, dict):
            raise ValueProblem(
                f'found {shown(value)}; expected a group name, a list of them, or {{group = ["x", "y", "z"]}}'
            )
        for group, components in value.items():
            wrong = [c for c in components if c not in DIRECTIONS] if isinstance(components, list) else [components]
            if wrong or not components:
                raise ValueProblem(
                    f"found {shown(components)} at group {group!r}; held components are of {', '.join(DIRECTIONS)}"
                )
        return {group: tuple(components) for group, components in value.items()}

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the three forms."""
        names = {"type": "array", "items": {"type": "string"}}
        held = {"type": "array", "items": {"enum": list(DIRECTIONS)}, "minItems": 1}
        return {"anyOf": [{"type": "string"}, names, {"type": "object", "additionalProperties": held}]}


class _Ratio(_Readable):
    """One damping ratio, or one per mode."""

    one, many = Quantity("", least=0.0, below=1.0), Quantity("", (None,), least=0.0, below=1.0)

    def read(self, value: Any) -> Any:
        """A float or a tuple of them."""
        return (self.many if isinstance(value, list) else self.one).read(value)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both forms."""
        return {"anyOf": [self.one.json_schema(), self.many.json_schema()]}


Clamp = Annotated[dict[str, tuple[str, ...]], _ClampValue()]
Component = Literal["x", "y", "z", "rx", "ry", "rz"]


class Inertia(_Readable):
    """Three principal moments, or a symmetric 3 x 3 matrix (off-diagonal entries are minus the products of inertia)."""

    moments, matrix = Quantity("kg m^2", (3,)), Quantity("kg m^2", (3, 3))

    def read(self, value: Any) -> Matrix:
        """The matrix; checked as one that a distribution of mass can have."""
        if isinstance(value, list) and value and not isinstance(value[0], list):
            a, b, c = self.moments.read(value)
            rows: Matrix = ((a, 0.0, 0.0), (0.0, b, 0.0), (0.0, 0.0, c))
        else:
            rows = self.matrix.read(value)
        _check_inertia(rows)
        return rows

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both forms."""
        return {"anyOf": [self.moments.json_schema(), self.matrix.json_schema()], "unit": "kg m^2"}


def _check_inertia(rows: Matrix) -> None:
    import numpy as np

    J = np.array(rows)
    if np.abs(J - J.T).max() > 1e-9 * np.abs(J).max():
        i, j = np.unravel_index(np.argmax(np.abs(J - J.T)), (3, 3))
        raise ValueProblem(
            f"found an inertia that is not symmetric: entry ({i + 1}, {j + 1}) is {J[i, j]:g}, ({j + 1}, {i + 1}) "
            f"is {J[j, i]:g} kg m^2"
        )
    least, middle, most = np.linalg.eigvalsh(J)
    principal = f"{least:.7g}, {middle:.7g}, {most:.7g} kg m^2"
    if least < 0 or most <= 0:
        raise ValueProblem(
            f"found an inertia that is not positive definite, with principal moments {principal}; check signs and "
            f"entries"
        )
    if least + middle < most * (1 - 1e-9):
        raise ValueProblem(
            f"found an inertia that breaks the triangle inequality, with principal moments {principal}; "
            "the two smaller must sum to at least the largest"
        )


class MarkerTable(Table):
    """A named place on a body, with its own axes."""

    position: Position | None = None
    """On a meshed body: that of the mesh point nearest to it."""
    group: str | None = None
    """Mesh group (point, edge, face): mean displacement and least-squares rotation of its nodes."""
    orientation: Orientation | None = None
    """Axes of the marker; left out, those of the body."""


class BoxShape(Table):
    """A box to draw, edges along the body axes unless turned."""

    kind: Literal["box"]
    size: Annotated[Position, Quantity("m", (3,), above=0.0)]
    position: Position = (0.0, 0.0, 0.0)
    orientation: Orientation | None = None


class CylinderShape(Table):
    """A cylinder to draw, along its axis."""

    kind: Literal["cylinder"]
    radius: PositiveLength
    length: PositiveLength
    axis: Direction = (0.0, 0.0, 1.0)
    position: Position = (0.0, 0.0, 0.0)


class MeshShape(Table):
    """A mesh file to draw."""

    kind: Literal["mesh"]
    file: str
    mesh_unit: Literal["m", "mm", "cm", "inch"] = "m"
    position: Position = (0.0, 0.0, 0.0)
    orientation: Orientation | None = None


Shape = Annotated[BoxShape | CylinderShape | MeshShape, Field(discriminator="kind")]


class DampingTable(Table):
    """Elastic damping: a fraction of critical damping, or Rayleigh's two numbers."""

    ratio: Annotated[float | tuple[float, ...] | None, _Ratio()] = None
    """Fraction of critical damping of every mode; 0.005 is half a percent."""
    mass: Annotated[float, Quantity("1/s", least=0.0)] | None = None
    """alpha of D = alpha M + beta K."""
    stiffness: Annotated[float, Quantity("s", least=0.0)] | None = None
    """beta of D = alpha M + beta K."""

    @model_validator(mode="after")
    def _one_kind(self) -> DampingTable:
        rayleigh = self.mass is not None or self.stiffness is not None
        if (self.ratio is not None) == rayleigh:
            refuse(
                "found "
                + ("ratio together with mass or stiffness" if rayleigh else "no damping")
                + "; give ratio, or mass and stiffness"
            )
        return self


class InitialTable(Table):
    """Elastic state at t = 0: modal amplitudes, or the displacement of a marker."""

    amplitudes: Annotated[tuple[float, ...] | None, Quantity("kg^0.5 m", (None,))] = None
    """Of the first elastic coordinates; the others are zero."""
    rates: Annotated[tuple[float, ...] | None, Quantity("kg^0.5 m/s", (None,))] = None
    marker: str | None = None
    """Whose displacement is given."""
    displacement: Position | None = None
    """Along the marker's undeformed axes; the body is at rest."""
    relative: Annotated[Direction, Quantity("", (3,))] | None = None
    """The same as a fraction of `length`."""
    length: PositiveLength | None = None
    """Left out: distance from the body's joint to the marker."""
    shape: Literal["modes", "static"] = "modes"
    """How the rest of the body moves along: in the modes named, or as under a static force at the marker."""
    modes: Annotated[list[Whole] | None, Field(min_length=1)] = None
    """Numbers (from 1) of the modes used; left out, the lowest that reach the displacement."""

    @model_validator(mode="after")
    def _one_way(self) -> InitialTable:
        exactly_one(self, ("amplitudes", "displacement", "relative"), required=self.rates is None)
        displaced = self.displacement is not None or self.relative is not None
        if displaced != (self.marker is not None):
            refuse("found a displacement without marker, or a marker without displacement; they belong together")
        if self.modes is not None and (self.shape == "static" or not displaced):
            refuse("found modes, which go with a displacement in shape = 'modes' only")
        if self.length is not None and self.relative is None:
            refuse("found length without relative; it is what `relative` is a fraction of")
        return self


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
    inertia: Annotated[Matrix, Inertia()]
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
    family: str
    """beam, plate, ...: `femflex schema` and the README list them with their options."""
    section: str | None = None
    """Name in [sections]."""
    material: str | None = None
    """Name in [materials]."""
    options: dict[str, Any] = Field(default_factory=dict)


class PointMassTable(Table):
    """A concentrated mass at every point of a mesh group."""

    group: str
    mass: Mass
    inertia: Annotated[Matrix, Inertia()] | None = None
    offset: Position = (0.0, 0.0, 0.0)
    """Of the mass's centre from the node."""


class CantileverTable(Table):
    """Vibration modes with groups clamped in the body frame."""

    method: Literal["cantilever"]
    clamp: Clamp
    modes: Whole
    attachment: list[Component] = Field(default_factory=list)
    """Directions of acceleration of the clamp whose static shapes are added."""

    @model_validator(mode="after")
    def _is_held(self) -> CantileverTable:
        if not self.clamp:
            refuse(
                "found no group to clamp; cantilever modes need the structure held, so name a group, or use method "
                "= 'free_free'"
            )
        return self


class FreeFreeTable(Table):
    """Elastic modes of the unconstrained structure; the body frame follows the mean motion."""

    method: Literal["free_free"]
    modes: Whole


class CraigBamptonTable(Table):
    """Fixed-interface modes and constraint modes of interface groups."""

    method: Literal["craig_bampton"]
    interfaces: list[str]
    modes: Annotated[int, Count(0)]
    """Fixed-interface modes kept beside the constraint modes."""
    clamp: Clamp = Field(default_factory=dict)
    interface: Literal["rigid", "nodal"] = "rigid"
    """rigid: the nodes of a group move as one; nodal: each has shapes of its own."""


class NodalTable(Table):
    """The nodal displacements themselves, with groups clamped: no reduction."""

    method: Literal["nodal"]
    clamp: Clamp


class LumpedTable(Table):
    """Nodal translations with lumped masses; rotations condensed out."""

    method: Literal["lumped"]
    clamp: Clamp


class StiffTable(Table):
    """No elastic coordinates: the mesh gives mass, inertia and picture."""

    method: Literal["rigid"]


Reduction = Annotated[
    CantileverTable | FreeFreeTable | CraigBamptonTable | NodalTable | LumpedTable | StiffTable,
    Field(discriminator="method"),
]


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
    reduction: Reduction
    damping: DampingTable | None = None

    @model_validator(mode="after")
    def _markers_have_place(self) -> FlexibleTable:
        for name, marker in self.markers.items():
            if marker.group is not None and marker.position is not None:
                refuse(f"found group and position in marker {name!r}; give one of them")
        return self


class FunctionsTable(Table):
    """Admissible functions of a beam: how many for each field, and which."""

    y: Annotated[int, Count(0)] = 0
    """Bending along the section's y axis."""
    z: Annotated[int, Count(0)] = 0
    axial: Annotated[int, Count(0)] = 0
    torsion: Annotated[int, Count(0)] = 0
    family: Literal["characteristic", "polynomial"] = "characteristic"
    ends: str = "clamped-free"
    """Supports of root and tip in the body frame, of free, pinned, clamped."""
    static: StrictBool = False
    """The last functions are the static shapes of an accelerated root."""


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
    radius: PositiveLength | None = None
    """Of the tube that is drawn; left out, a line."""
    functions: FunctionsTable
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
__all__ = [
    "AnalyticTable",
    "Body",
    "BodyTable",
    "FileTable",
    "FlexibleTable",
    "InitialTable",
    "MarkerTable",
    "RigidTable",
]
