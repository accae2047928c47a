"""Reduction of a meshed body: the shapes of its basis, its clamps and its damping."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, model_validator

from femflex.fem.support import Clamp
from femflex.noun.table import Table, refuse
from femflex.noun.values import (
    MOST_FUNCTIONS,
    Count,
    PositiveLength,
    Quantity,
    ValueProblem,
    Whole,
    _Readable,
    value_text,
)


class _Ratio(_Readable):
    """One damping ratio, or one per mode."""

    scalar, vector = Quantity("", least=0.0, below=1.0), Quantity("", (None,), least=0.0, below=1.0)

    def read_value(self, value: Any) -> Any:
        """A float or a tuple of them."""
        return (self.vector if isinstance(value, list) else self.scalar).read_value(value)

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both forms."""
        return {"anyOf": [self.scalar.json_schema(), self.vector.json_schema()]}


class _DerivativeCount(_Readable):
    """A number of derivative shapes, or the word for how many."""

    words = ("auto", "all", "none")

    def read_value(self, value: Any) -> int | str:
        """The number or the word."""
        if isinstance(value, str) and value in self.words:
            return value
        if isinstance(value, int) and not isinstance(value, bool) and value >= 0:
            return value
        words = ", ".join(repr(word) for word in self.words)
        raise ValueProblem(f"found {value_text(value)}; expected a number of derivative shapes, or one of {words}")

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of both forms."""
        return {"anyOf": [{"type": "integer", "minimum": 0}, {"enum": list(self.words)}]}


Derivatives = Annotated[int | str | None, _DerivativeCount()]
Component = Literal["x", "y", "z", "rx", "ry", "rz"]


class DampingTable(Table):
    """Elastic damping: a fraction of critical damping, or Rayleigh's two numbers."""

    ratio: Annotated[float | tuple[float, ...] | None, _Ratio()] = None
    """Fraction of critical damping of the vibration modes at rest: one number, or one per mode; 0.005 is 0.5 %."""
    mass: Annotated[float, Quantity("1/s", least=0.0)] | None = None
    """Mass-proportional coefficient alpha of Rayleigh damping, D = alpha M + beta K."""
    stiffness: Annotated[float, Quantity("s", least=0.0)] | None = None
    """Stiffness-proportional coefficient beta of Rayleigh damping, D = alpha M + beta K."""

    @model_validator(mode="after")
    def _ratio_or_rayleigh(self) -> DampingTable:
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
    """Modal derivatives added to the basis, so that bending need not stretch: a number, 'auto', 'all' or 'none'. 'auto'
    adds them until 1e-6 of their energy is left out, and all that a spin and the twist of a bent strip need. With
    nonlinear strain 'none' counts as your choice."""
    third_derivatives: Annotated[int, Count(0)] | None = None
    """Number of the lowest shapes that get a static correction of third order, computed at rest. It needs nonlinear or
    condensed strain. Default: 0. Exception: a flat plate so wide and thin that it stops curving crosswise as it bends
    gets one shape, found by large static deflections; `run` says so."""
    deflection: PositiveLength | None = None
    """Largest deflection of the lowest shape that the derivatives must serve. They are then taken from static states
    with this deflection (8 n^2 states of n shapes), not at rest. Use it for snap-through or for bends of several
    thicknesses. With `responses` it is the deflection of the responses instead."""
    responses: Annotated[int, Count(0)] = 0
    """Number of shapes taken from static responses up to `deflection`, in both directions. The loads are accelerations
    along `attachment` and the forces and moments of `loads`. Default of both: the acceleration that moves the body
    most. Use 8 for curved panels and arches that snap through. It needs strain = 'nonlinear'."""

    joints: dict[str, list[Component]] | None = None
    """Group -> directions of joint forces and moments whose static shapes are added; at a clamped group, directions of
    acceleration. Default: those that change by 0.05 % one of the craft's first three elastic frequencies, one below
    `band`, or one that the run excites. None are added at clamps if `attachment` is given, nor elsewhere if `loads` is
    given. {} adds none."""

    @model_validator(mode="after")
    def _deflection_has_derivatives(self) -> Stretchable:
        if self.responses and self.deflection is None:
            refuse(
                f"found responses = {self.responses} without deflection; give the deflection that they reach, such as "
                "deflection = '4 cm'"
            )
        if self.deflection is not None and self.derivatives in (None, "none", 0) and not self.responses:
            refuse(
                f"found deflection = {self.deflection:g} m without derivatives; derivative shapes are taken at this "
                "deflection, so give derivatives too, such as derivatives = 8"
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
    """Selects this reduction: vibration modes of the clamped structure."""
    clamp: Clamp
    """Clamped groups: a name, a list of names, or group -> support. A support is a list of components such as ["x",
    "y", "z"], { symmetry = NORMAL }, { antisymmetry = NORMAL }, or { components = [...], axes = [three directions] }.
    """
    modes: Whole
    """Number of vibration modes kept, the lowest first."""
    attachment: list[Component] = Field(default_factory=list)
    """Directions of acceleration of the clamp whose static shapes are added. Default: none, or those of the weight
    where there is gravity, strain is nonlinear or condensed, and derivatives = 'auto'."""
    spin: StrictBool | None = None
    """Static shapes of a spin in addition to the modes (the slow ones of all six accelerations). It needs nonlinear or
    condensed strain with derivatives = 'auto'. Default: true for bodies that spin steadily, unless `attachment` is
    given."""
    loads: dict[str, list[Component]] = Field(default_factory=dict)
    """Group -> directions of unit forces and moments whose static shapes are added. Default: those of the case's loads
    of whose work the modes miss 1 %; with nonlinear or condensed strain all slow ones of the loads and attached bodies.
    {} adds none."""

    @model_validator(mode="after")
    def _has_a_clamp(self) -> CantileverTable:
        if not self.clamp:
            refuse(
                "found no group to clamp; cantilever modes are those of a clamped structure, so name a group, or use "
                "method = 'free_free'"
            )
        return self


class FreeFreeTable(Stretchable):
    """Elastic modes of the unconstrained structure; the body frame follows the mean motion."""

    method: Literal["free_free"]
    """Selects this reduction: elastic modes of the unconstrained structure."""
    modes: Whole
    """Number of elastic modes kept, the lowest first; rigid-body modes do not count."""


class CraigBamptonTable(Stretchable):
    """Fixed-interface modes and constraint modes of interface groups."""

    method: Literal["craig_bampton"]
    """Selects this reduction: fixed-interface modes and constraint modes."""
    interfaces: list[str] = Field(default_factory=list)
    """Groups of nodes that joints hold; a segment's interfaces are its two ends."""
    modes: Annotated[int, Count(0)]
    """Number of fixed-interface modes kept in addition to the constraint modes."""
    clamp: Clamp = Field(default_factory=dict)
    """Groups clamped in the body frame, written as for cantilever modes."""
    interface: Literal["rigid", "nodal"] = "rigid"
    """Motion of an interface: "rigid", its nodes move as one; "nodal", each node has shapes of its own."""


class NodalTable(Table):
    """The nodal displacements themselves, with groups clamped: no reduction."""

    method: Literal["nodal"]
    """Selects this reduction: every nodal displacement is a coordinate."""
    clamp: Clamp
    """Groups clamped in the body frame, written as for cantilever modes."""


class LumpedTable(Table):
    """Nodal translations with lumped masses; rotations condensed out."""

    method: Literal["lumped"]
    """Selects this reduction: nodal translations with lumped masses."""
    clamp: Clamp
    """Groups clamped in the body frame, written as for cantilever modes."""


class StiffTable(Table):
    """No elastic coordinates: the mesh gives mass, inertia and picture."""

    method: Literal["rigid"]
    """Selects this reduction: a rigid body."""


Reduction = Annotated[
    CantileverTable | FreeFreeTable | CraigBamptonTable | NodalTable | LumpedTable | StiffTable,
    Field(discriminator="method"),
]


class FunctionsTable(Table):
    """Admissible functions of a beam: how many for each field, and which."""

    y: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for bending along the section's y axis."""
    z: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for bending along the section's z axis."""
    axial: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for axial displacement."""
    torsion: Annotated[int, Count(0, MOST_FUNCTIONS)] = 0
    """Number of functions for the twist angle."""
    family: Literal["characteristic", "polynomial"] = "characteristic"
    """Functions: "characteristic", the vibration modes of a uniform beam; "polynomial", polynomials of the same
    supports."""
    ends: str = "clamped-free"
    """Supports of root and tip in the body frame, such as "clamped-free"; each is free, pinned or clamped."""
    static: StrictBool = False
    """The last functions are the static shapes of an accelerated root."""
    spin: StrictBool | None = None
    """Static shapes of a spin in addition to the functions: two more along y and along z, one of axial
    displacement and one of torsion, where strain is not linear. Only for clamped-free characteristic functions. Left
    out: true where the case spins steadily, unless `static` is given."""
    joints: list[Literal["root", "tip"]] | None = None
    """Static shapes of an accelerated root and of a tip force and moment in addition to the functions: two more along y
    and z for each, one of axial displacement and one of torsion. Only for clamped-free characteristic functions. Left
    out: those that change by 0.05 % one of the craft's first three elastic frequencies, one below `band`, or one that
    the run excites, unless `static` is given."""
    loads: StrictBool | None = None
    """Static shapes of a force and a moment at the tip in addition to the functions, as those of `joints`: for loads at
    the tip. Only for clamped-free characteristic functions. Left out: where the functions answer such a load by less
    than 99 % of its static work, as one function answers a force (97 %), and many a moment or a torque."""
