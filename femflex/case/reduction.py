"""How a meshed body is reduced: which shapes it may take, what is clamped, how it is damped."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, model_validator

from femflex.case.base import Table, refuse
from femflex.case.support import SkewSupport, read_support, support_schema
from femflex.case.values import Count, PositiveLength, Quantity, ValueProblem, Whole, _Readable, shown


class _ClampValue(_Readable):
    """Group names, or group name -> support. Reads into a dict; an empty tuple of components holds all six."""

    def read(self, value: Any) -> dict[str, tuple[str, ...] | SkewSupport]:
        """Group -> components held, or a support in axes of its own."""
        if isinstance(value, str):
            value = [value]
        if isinstance(value, list) and all(isinstance(name, str) for name in value):
            return dict.fromkeys(value, ())
        if not isinstance(value, dict):
            raise ValueProblem(
                f'found {shown(value)}; expected a group name, a list of them, or {{group = ["x", "y", "z"]}}'
            )
        return {group: read_support(group, support) for group, support in value.items()}

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the three forms."""
        names = {"type": "array", "items": {"type": "string"}}
        return {"anyOf": [{"type": "string"}, names, {"type": "object", "additionalProperties": support_schema()}]}


class _Ratio(_Readable):
    """One damping ratio, or one per mode."""

    one, many = Quantity("", least=0.0, below=1.0), Quantity("", (None,), least=0.0, below=1.0)

    def read(self, value: Any) -> Any:
        """A float or a tuple of them."""
        return (self.many if isinstance(value, list) else self.one).read(value)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both forms."""
        return {"anyOf": [self.one.json_schema(), self.many.json_schema()]}


class _KeptDerivatives(_Readable):
    """A number of derivative shapes, or the word for how many."""

    words = ("auto", "all", "none")

    def read(self, value: Any) -> int | str:
        """The number or the word."""
        if isinstance(value, str) and value in self.words:
            return value
        if isinstance(value, int) and not isinstance(value, bool) and value >= 0:
            return value
        words = ", ".join(repr(word) for word in self.words)
        raise ValueProblem(f"found {shown(value)}; expected a number of derivative shapes, or one of {words}")

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both forms."""
        return {"anyOf": [{"type": "integer", "minimum": 0}, {"enum": list(self.words)}]}


Derivatives = Annotated[int | str | None, _KeptDerivatives()]
Clamp = Annotated[dict[str, tuple[str, ...] | SkewSupport], _ClampValue()]
Component = Literal["x", "y", "z", "rx", "ry", "rz"]


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


class Stretchable(Table):
    """A set of shapes that may be given static derivatives."""

    derivatives: Derivatives = None
    """How many static derivatives of pairs of shapes are added, so that bending need not stretch: a number, 'auto'
    (until 1e-6 of their energy is left out, and all that a spin and the twist of a bent strip need), 'all', or 'none',
    which nonlinear strain takes as a choice."""
    third_derivatives: Annotated[int, Count(0)] | None = None
    """How many of the lowest shapes get a static answer of third order, at rest, as one more coordinate. It wants
    nonlinear or condensed strain. Left out: none, but of flat plates so wide and thin that they stop curving crosswise
    as they bend the lowest shape's own change, found by bending them far; `run` says so."""
    deflection: PositiveLength | None = None
    """Largest deflection, of the lowest shape, that the derivatives are to serve: they are then taken from static
    states bent so far (8 n^2 of n shapes) and not at rest. For what snaps through or bends by several thicknesses.
    With `responses` it is theirs instead."""
    responses: Annotated[int, Count(0)] = 0
    """How many shapes are taken from static responses up to `deflection`, both ways, to accelerations along the
    directions of `attachment` and to the forces and moments of `loads` (both left out: the acceleration that moves the
    body most). For curved panels and arches that snap through: eight of them do it. Wants strain = 'nonlinear'."""

    joints: dict[str, list[Component]] | None = None
    """Group -> directions of the forces and moments of joints there whose static shapes are added; at a clamped group,
    of accelerations. Left out: those that change one of the craft's first three elastic frequencies, or one below
    `band`, by 0.05 %; not at clamps where `attachment` is given, nor elsewhere where `loads` is. {} for none."""

    @model_validator(mode="after")
    def _derives(self) -> Stretchable:
        if self.responses and self.deflection is None:
            refuse(f"found responses = {self.responses} without deflection; say how far they go, deflection = '4 cm'")
        if self.deflection is not None and self.derivatives in (None, "none", 0) and not self.responses:
            refuse(
                f"found deflection = {self.deflection:g} m without derivatives, which it is for; give derivatives too, "
                "such as derivatives = 8"
            )
        if self.deflection is not None and not getattr(self, "clamp", None):
            refuse(
                f"found deflection = {self.deflection:g} m in a reduction without a clamp; derivatives are taken from "
                "bent states of a clamped structure alone, so leave it out"
            )
        return self


class CantileverTable(Stretchable):
    """Vibration modes with groups clamped in the body frame."""

    method: Literal["cantilever"]
    clamp: Clamp
    modes: Whole
    attachment: list[Component] = Field(default_factory=list)
    """Directions of acceleration of the clamp whose static shapes are added. Left out where strain is nonlinear or
    condensed with derivatives = 'auto': those of the weight, if there is gravity."""
    spin: StrictBool | None = None
    """Static shapes of a spin (the slow ones of all six accelerations) beside the modes, where strain is nonlinear or
    condensed with derivatives = 'auto'. Left out: where the case spins steadily, or is foreseen to spin up fast for
    the body, if it is of beams and has five modes at most; not where `attachment` is said."""
    loads: dict[str, list[Component]] = Field(default_factory=dict)
    """Group -> directions of unit forces and moments there whose static shapes are added. Left out: those of the case's
    own loads that the modes leave 1 % of the work of, and with nonlinear or condensed strain all slow ones of its loads
    and of where other bodies hang on it; {} for none."""

    @model_validator(mode="after")
    def _is_held(self) -> CantileverTable:
        if not self.clamp:
            refuse(
                "found no group to clamp; cantilever modes need the structure held, so name a group, or use method "
                "= 'free_free'"
            )
        return self


class FreeFreeTable(Stretchable):
    """Elastic modes of the unconstrained structure; the body frame follows the mean motion."""

    method: Literal["free_free"]
    modes: Whole


class CraigBamptonTable(Stretchable):
    """Fixed-interface modes and constraint modes of interface groups."""

    method: Literal["craig_bampton"]
    interfaces: list[str] = Field(default_factory=list)
    """Groups that joints hold; a segment's are its two ends."""
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
    spin: StrictBool | None = None
    """Static shapes of a spin beside the functions: two more along y and z each, one of axial and torsion each, where
    strain is not linear. Of characteristic functions, clamped-free; polynomials hold them. Left out: where the case
    spins steadily, or is foreseen to spin up fast for the body, unless `static` is said."""
    joints: list[Literal["root", "tip"]] | None = None
    """Static shapes of an accelerated root and of a force and moment at the tip beside the functions: two more along y
    and z for each, one of axial and torsion. Of characteristic functions, clamped-free. Left out: those that change one
    of the craft's first three elastic frequencies, or one below `band`, by 0.05 %, unless `static` is given."""
