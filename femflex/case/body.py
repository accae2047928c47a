"""[bodies.<name>]: rigid, meshed or of a deck, analytic, or read from the file of a reduced body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, ValidationInfo, field_validator, model_validator

from femflex.case.body_base import BodyTable as BodyTable
from femflex.case.deploying import DeployingTable
from femflex.case.matrices import MatricesTable
from femflex.case.shape import Shape
from femflex.fem.bushing import Bushing
from femflex.fem.connections import Distributing, Equation, Rigid
from femflex.fem.family import OPTIONS, Option
from femflex.fem.point_mass import PointMass
from femflex.noun.inertia import InertiaMatrix
from femflex.noun.table import Name, Table, exactly_one, refuse
from femflex.noun.units import UnitError
from femflex.noun.values import Count, Mass, Position, Quantity, ValueProblem, Whole, _Readable, value_text
from femflex.reduction.beams.uniform_beam import FunctionsTable, UniformBeam
from femflex.reduction.methods import Reduction
from femflex.reduction.modes.damping import Damping
from femflex.reduction.preload.loads import Preload


def read_options(family: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The options with their quantities in SI. Names the family does not have are reported where it is built."""
    import femflex.fem  # noqa: F401  # registers the families

    declared = OPTIONS.get(family, {})
    return {
        name: _option_value(name, declared[name], value) if name in declared else value
        for name, value in options.items()
    }


def _option_value(name: str, option: Option, value: Any) -> Any:
    if option.unit is None:
        return value
    if option.field and isinstance(value, dict):
        return _formula(name, option, value)
    try:
        return _option_quantities(option)[-1 if isinstance(value, list) else 0].read_value(value)
    except (ValueProblem, UnitError) as problem:
        refuse(f"{name}: {problem}")


def _formula(name: str, option: Option, value: Mapping[str, Any]) -> Any:
    """The text of a formula, or as many texts as the option has numbers."""
    formula, counts = value.get("formula"), option.shapes
    texts = [formula] if isinstance(formula, str) else formula
    if set(value) != {"formula"} or not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
        refuse(f'{name}: found {dict(value)!r}; a field is a number, or {{ formula = "..." }} of x, y and z')
    if (0 if isinstance(formula, str) else len(texts)) not in counts:
        refuse(f"{name}: found {len(texts)} formulas; it takes {' or '.join(str(max(n, 1)) for n in counts)}")
    return formula if isinstance(formula, str) else tuple(texts)


def _option_quantities(option: Option) -> list[Quantity]:
    """Quantities that the option may be, a single number first."""
    assert option.unit is not None
    return [Quantity(option.unit, (n,) if n else ()) for n in sorted(option.shapes)]


def add_options(schema: dict[str, Any]) -> None:
    """Add the options of each family to a member's JSON Schema, with their meanings, units and defaults."""
    import femflex.fem  # noqa: F401

    schema["allOf"] = [
        {
            "if": {"properties": {"family": {"const": family}}},
            "then": {"properties": {"options": _options_schema(options)}},
        }
        for family, options in OPTIONS.items()
    ]


def _formula_schema(option: Option) -> dict[str, Any]:
    text = {"type": "string", "description": "arithmetic of x, y and z of the mesh, in SI"}
    texts = {"type": "array", "items": text, "minItems": max(option.shapes), "maxItems": max(option.shapes)}
    formulas = text if option.shapes == (0,) else texts | {"description": "one formula for each component"}
    return {
        "type": "object",
        "properties": {"formula": formulas},
        "required": ["formula"],
        "additionalProperties": False,
    }


def _options_schema(options: Mapping[str, Option]) -> dict[str, Any]:
    properties = {}
    for name, option in options.items():
        annotations: dict[str, Any] = {"description": option.meaning}
        if option.default is not None:
            annotations["default"] = list(option.default) if isinstance(option.default, tuple) else option.default
        kinds = [] if option.unit is None else [kind.json_schema() for kind in _option_quantities(option)]
        if option.field:
            kinds.append(_formula_schema(option))
        properties[name] = ({} if not kinds else kinds[0] if len(kinds) == 1 else {"anyOf": kinds}) | annotations
    return {"type": "object", "properties": properties, "additionalProperties": False}


UNITS_OF = {
    "E": ("Pa",), "E1": ("Pa",), "E2": ("Pa",), "E3": ("Pa",), "G": ("Pa",), "G12": ("Pa",), "G13": ("Pa",),
    "G23": ("Pa",), "density": ("kg/m^3",), "A": ("m^2",), "I1": ("m^4",), "I2": ("m^4",), "J": ("m^4",),
    "thickness": ("m",), "nonstructural_mass": ("kg/m", "kg/m^2"), "K1": ("N/m",), "K2": ("N/m",), "K3": ("N/m",),
    "K4": ("N m",), "K5": ("N m",), "K6": ("N m",),
}  # fmt: skip


class OverrideValues(_Readable):
    """Name -> key -> value; texts with units are read by the key."""

    def read_value(self, value: Any) -> dict[str, dict[str, float]]:
        """The values in SI. Raises ValueProblem."""
        if not isinstance(value, dict):
            raise ValueProblem(
                f"found {value_text(value)}; expected tables such as {{ pid_3 = {{ thickness = '2 mm' }} }}"
            )
        overrides: dict[str, dict[str, float]] = {}
        for name, table in value.items():
            if not isinstance(table, dict):
                raise ValueProblem(f"found {value_text(table)} for {name!r}; expected a table of values")
            overrides[name] = {key: _number(name, key, number_text) for key, number_text in table.items()}
        return overrides

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the tables."""
        number = {"anyOf": [{"type": "number"}, {"type": "string"}]}
        return {
            "type": "object",
            "additionalProperties": {"type": "object", "additionalProperties": number},
        }


def _number(name: str, key: str, value: Any) -> float:
    base = key.split("_")[0] if key.startswith("thickness_") else key
    problem: Exception | None = None
    for unit in UNITS_OF.get(base, ("",)):
        try:
            return float(Quantity(unit).read_value(value))
        except (ValueProblem, UnitError) as error:
            problem = problem or error
    raise ValueProblem(f"{name}.{key}: {problem}")


Strain = Literal["linear", "nonlinear", "condensed"]
Connection = Annotated[Rigid | Distributing | Equation, Field(discriminator="kind")]
TENSION = ("tether", "membrane")  # families that carry tension only
STRETCHABLE = ("cantilever", "free_free", "craig_bampton")


class ImbalanceTable(Table):
    """Imbalance of a rotor about its z axis, in addition to mass, inertia and centre of the balanced one."""

    static: Annotated[float, Quantity("kg m")] = 0.0
    """Static imbalance: the centre of mass moves by static / mass along x."""
    dynamic: Annotated[float, Quantity("kg m^2")] = 0.0
    """Dynamic imbalance: the product of inertia int x z dm about the balanced centre."""


class RigidTable(BodyTable):
    """A rigid body."""

    kind: Literal["rigid"]
    """Selects this body: a rigid one."""
    mass: Mass
    """Total mass."""
    inertia: InertiaMatrix = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    """Moments of inertia in body axes: three principal moments, or a symmetric 3 x 3 matrix. Off-diagonal entries are
    minus the products of inertia. Default: none, a point mass at `center_of_mass`."""
    center_of_mass: Position = (0.0, 0.0, 0.0)
    """Position of the centre of mass in the body frame."""
    inertia_about: Literal["center_of_mass", "origin"] = "center_of_mass"
    """Reference point of `inertia`: the centre of mass, or the origin of the body frame."""
    imbalance: ImbalanceTable | None = None
    """Imbalance of a rotor that turns about its z axis. Default: none."""
    shapes: list[Shape] = Field(default_factory=list)
    """Shapes drawn in pictures. Default: a box with this mass and inertia; of a point mass, a cube of it in water."""

    @model_validator(mode="after")
    def _rigid_only(self) -> RigidTable:
        if "inertia" not in self.model_fields_set:
            for key in ("inertia_about", "imbalance"):
                if key in self.model_fields_set:
                    refuse(
                        f"found {key} on a point mass, a rigid body without inertia; give inertia, or take {key} out"
                    )
        if self.initial is not None:
            refuse(
                "found initial on a rigid body, which has no elastic coordinates; joints and [attitude] set its motion"
            )
        if self.recovery:
            refuse("found recovery on a rigid body, which has no stress; take it out")
        for name, marker in self.markers.items():
            if marker.group is not None:
                refuse(f"found group in marker {name!r} of a rigid body, which has no mesh; give position")
        return self


class MemberTable(Table):
    """A mesh group that becomes structure."""

    group: str
    """Mesh group that the member covers."""
    model_config = ConfigDict(json_schema_extra=add_options)

    family: str
    """Element family: beam, plate, plate_bfs, shell, solid, tether or membrane."""
    section: str | None = None
    """Name in [sections]. Default: none, for solids."""
    material: str | None = None
    """Name in [materials]. Default: none, where the section brings its own."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Options of the family, such as the order of a beam, prestress or thermal strain."""
    segments: Annotated[int, Count(1)] | None = None
    """Number of bodies into which this line is cut; they are welded end to end, so that the line may bend without
    limit."""

    @field_validator("options", mode="after")
    @classmethod
    def _in_si(cls, options: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        return read_options(info.data.get("family", ""), options)


class RegionTable(Table):
    """A group of the mesh by place or number."""

    box: tuple[Position, Position] | None = None
    """Two opposite corners of a box, in the body frame: all points in it, and the cells between them."""
    nearest: Position | None = None
    """The mesh point nearest to this position in the body frame."""
    points: Annotated[list[Whole], Field(min_length=1)] | None = None
    """Points by number, from 1 in the order of the mesh file."""
    within: str | None = None
    """Mesh group whose points alone count, with box. Default: all points."""

    @model_validator(mode="after")
    def _one_definition(self) -> RegionTable:
        exactly_one(self, ("box", "nearest", "points"))
        return self


class FlexibleTable(BodyTable):
    """A body made of finite elements on a mesh; the body frame is the mesh's coordinates."""

    kind: Literal["flexible"]
    """Selects this body: finite elements on a mesh."""
    mesh: str | None = None
    """Mesh file, relative to the case file. Default, with deck: that of the deck."""
    deck: str | None = None
    """Input file of another solver (Nastran, Abaqus) with elements, properties, materials, connections and supports, in
    place of mesh. Its properties, sets and nodes are groups: pid_3, set_4, node_17. Default: a mesh is given."""
    units: str = "m-kg-s"
    """Units of the deck: length-mass-time or length-force-time, such as mm-t-s, m-kg-s, in-lbf-s or mm-kg-ms."""
    overrides: Annotated[dict[str, dict[str, float]], OverrideValues()] = Field(default_factory=dict)
    """Values that replace the deck's, by property or material: { pid_3 = { thickness = "2 mm" }, mat_1 = { E = "70
    GPa" } }."""
    mesh_unit: Literal["m", "mm", "cm", "inch"] = "m"
    """Unit of the mesh file's coordinates."""
    refine: Annotated[int, Count(0)] = 0
    """Number of uniform refinements; each halves every cell along each edge."""
    groups: dict[Name, str] = Field(default_factory=dict)
    """Names for groups that a format only numbers: wanted name -> name in the file, such as panel = "PID 1" or root =
    "SET 4" (Nastran)."""
    members: list[MemberTable] = Field(default_factory=list)
    """Mesh groups that become structure, each with family, section and material. Of a deck those alone that replace its
    own elements."""
    point_masses: list[PointMass] = Field(default_factory=list)
    """Concentrated masses at mesh points."""
    connections: list[Connection] = Field(default_factory=list)
    """Rigid and distributing interfaces between members, and equations of displacements."""
    regions: dict[Name, RegionTable] = Field(default_factory=dict)
    """Groups of the mesh by place or number. The groups all, all_lines, all_surfaces and all_solids exist without."""
    bushings: list[Bushing] = Field(default_factory=list)
    """Springs and bushings between nodes of the mesh."""
    preload: Preload | None = None
    """Steady loads under which the body finds its static equilibrium before it is reduced: its shape and tension there
    are those of the body at rest, and the same loads must act in the run. Default: none."""
    reduction: Reduction | None = None
    """Shapes that the body may take, and its clamps. Default, only with segments: static shapes of each segment and no
    modes between its ends."""
    strain: Strain | None = None
    """Strain energy: linear, nonlinear or condensed. linear: quadratic energy; bending does not stretch, and a spin
    does not stiffen. nonlinear: with the cubic and quartic terms (V2, V3) and coordinates for the stretch; needs
    derivatives. condensed: the same, with the stretch following the bending, so that no stiff coordinate is left. Left
    out: condensed where the expected motion needs it (spin, loads, weight, prescribed motions, initial deflections,
    loads near buckling), nonlinear where the body cannot be condensed, else linear. Every verb prints the choice and
    its reason. Default of bodies with a preload, tethers or membranes: condensed, or linear where the reduction has
    no derivatives."""
    damping: Damping | None = None
    """Structural damping. Default: none."""

    @property
    def segmented_member(self) -> MemberTable | None:
        """The member that is cut into segments, if one is."""
        return next((member for member in self.members if member.segments is not None), None)

    @model_validator(mode="before")
    @classmethod
    def _tension_is_nonlinear(cls, values: Any) -> Any:
        """Choose the strain of a body that tension stiffens: condensed, because tension comes with stretch."""
        if not isinstance(values, dict) or values.get("strain") is not None:
            return values
        members, reduction = values.get("members"), values.get("reduction")
        families = [m.get("family") for m in members if isinstance(m, dict)] if isinstance(members, list) else []
        tense = any(family in families for family in TENSION) or values.get("preload") is not None
        if not (tense and isinstance(reduction, dict)):
            return values
        stretches = reduction.get("method") in STRETCHABLE and reduction.get("derivatives") not in ("none", 0)
        return {**values, "strain": "condensed" if stretches else "linear"}

    @property
    def source(self) -> str:
        """The file of the body's mesh or deck."""
        return self.mesh or self.deck or ""

    @model_validator(mode="after")
    def _mesh_or_deck(self) -> FlexibleTable:
        if self.mesh is not None and self.deck is not None:
            refuse("found mesh and deck; give one of them")
        if self.mesh is None and self.deck is None:
            refuse("found neither mesh nor deck; give the file of one")
        if self.deck is None and not self.members:
            refuse("found no members; name the groups of the mesh that become structure")
        deck_keys = sorted(self.model_fields_set & {"units", "overrides"})
        if self.deck is None and deck_keys:
            refuse(
                f"found {', '.join(deck_keys)} without a deck; a mesh has mesh_unit, and its members have the values"
            )
        if self.deck is not None and (self.mesh_unit != "m" or self.groups):
            refuse("found mesh_unit or groups with a deck; give units, and name groups as the deck does (pid_3, set_4)")
        if self.deck is not None and self.segmented_member is not None:
            refuse("found segments in a member of a deck; bodies that are cut into segments have a mesh")
        return self

    @model_validator(mode="after")
    def _preload_has_one_reduction(self) -> FlexibleTable:
        if self.preload is not None and (
            self.segmented_member is not None or getattr(self.reduction, "method", "") == "lumped"
        ):
            description = "a body cut into segments" if self.segmented_member is not None else "a lumped body"
            refuse(f"found preload on {description}; give it to a body that is reduced as a whole by another method")
        return self

    @model_validator(mode="after")
    def _reduction_fits_segments(self) -> FlexibleTable:
        cut_groups = [member.group for member in self.members if member.segments is not None]
        if len(cut_groups) > 1:
            refuse(f"found segments in the members on {', '.join(cut_groups)}; one line of a body can be cut")
        method = getattr(self.reduction, "method", None)
        if not cut_groups and method is None:
            refuse("found no reduction; give one, such as { method = 'cantilever', clamp = 'root', modes = 8 }")
        if not cut_groups and method == "craig_bampton" and not getattr(self.reduction, "interfaces", ()):
            refuse("found craig_bampton without interfaces; name the groups at which joints attach")
        if cut_groups and method in ("lumped", "rigid"):
            refuse(
                f"found reduction method '{method}' and segments; a segment is reduced by craig_bampton, cantilever, "
                f"free_free or nodal"
            )
        if cut_groups and getattr(self.reduction, "loads", None):
            refuse(
                "found loads in the reduction of a body cut into segments; a segment's ends carry all loads, so drop it"
            )
        if getattr(self.reduction, "third_derivatives", 0) and (cut_groups or self.strain == "linear"):
            description = "cut into segments" if cut_groups else "with linear strain"
            refuse(
                f"found third_derivatives in the reduction of a body {description}, which has no use for them; "
                "drop them"
            )
        if getattr(self.reduction, "responses", 0) and (cut_groups or self.strain != "nonlinear"):
            description = "a body cut into segments" if cut_groups else f"a body with strain = {self.strain!r}"
            refuse(
                f"found responses in the reduction of {description}; they are for strain = 'nonlinear' of a whole body"
            )
        if self.segmented_member is not None and self.segmented_member.family in TENSION:
            refuse(
                f"found segments in a member of the family {self.segmented_member.family}, whose nodes have no "
                "rotation by which segments could be welded; raise the number of modes, or make it several "
                "bodies on ball joints"
            )
        if cut_groups and self.bushings:
            refuse("found bushings on a body cut into segments; leave them out, or join bodies by springs")
        if cut_groups and self.initial is not None:
            refuse("found initial on a body cut into segments; start from an equilibrium instead ([initial] from)")
        if cut_groups and self.damping is not None and (self.damping.ratio is not None or self.damping.mass):
            refuse(
                "found damping by ratio or mass on a body cut into segments, whose own modes are not those of the "
                "whole; give damping = { stiffness = ... }, which damps strain wherever it is"
            )
        return self

    @model_validator(mode="after")
    def _markers_have_one_position(self) -> FlexibleTable:
        for name, marker in self.markers.items():
            if marker.group is not None and marker.position is not None:
                refuse(f"found group and position in marker {name!r}; give one of them")
        return self


class AnalyticTable(UniformBeam, BodyTable):
    """A straight uniform beam on admissible functions, with markers root and tip; no mesh."""

    kind: Literal["analytic"]
    """Selects this body: a straight uniform beam on admissible functions."""
    functions: FunctionsTable
    """Number and kind of admissible functions."""
    strain: Strain | None = None
    """Strain energy, as for meshed bodies. nonlinear needs axial functions; condensed adds
    its own dependent ones."""
    damping: Damping | None = None
    """Structural damping. Default: none."""

    def built_in_markers(self) -> tuple[str, ...]:
        """The beam's two ends."""
        return ("origin", "root", "tip")


class FileTable(BodyTable):
    """A reduced body saved by `femflex body`."""

    kind: Literal["file"]
    """Selects this body: a reduced body from a file."""
    file: str
    """Body file, relative to the case file."""
    modes: Annotated[int, Count(0)] | None = None
    """Number of elastic coordinates kept, the first ones. Default: all."""
    damping: Damping | None = None
    """Structural damping. Default: that of the file."""


Body = Annotated[
    RigidTable | FlexibleTable | AnalyticTable | FileTable | MatricesTable | DeployingTable,
    Field(discriminator="kind"),
]
