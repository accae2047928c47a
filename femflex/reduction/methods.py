"""Methods of reduction: the shapes of a meshed body, and its clamps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, StrictBool, model_validator

from femflex.arrays import Array
from femflex.fem import Structure, Support
from femflex.fem.support import Clamp
from femflex.noun.table import Table, refuse
from femflex.noun.values import Count, PositiveLength, ValueProblem, Whole, _Readable, value_text
from femflex.reduction.large_deflection.derivatives import with_derivatives
from femflex.reduction.large_deflection.response_states import with_responses
from femflex.reduction.large_deflection.third_derivatives import with_sheet_shapes
from femflex.reduction.modes.craig_bampton import craig_bampton
from femflex.reduction.modes.residuals import with_attachment
from femflex.reduction.modes.vibration import (
    ModeSet,
    cantilever_modes,
    free_free_modes,
    load_vectors,
    lumped,
    nodal,
    nodal_translations,
    rigid_set,
)
from femflex.warning import warn_of_physics

Slow = Callable[[ModeSet], Array]


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

    def modes_alone(self, structure: Structure, n: int) -> ModeSet:
        """The set of n modes, without static shapes."""
        raise NotImplementedError

    def vibration_set(self, structure: Structure, modes: int | None = None, slow: Slow | None = None) -> ModeSet:
        """Its modes (`modes` of them instead of its own number if given) and static shapes, without derivatives.

        slow: of a set, its loads (n_dof, k) that are slow compared with it
        """
        shapes = self.modes_alone(structure, getattr(self, "modes", 0) if modes is None else modes)
        F = np.zeros((structure.n_dof, 0)) if slow is None else slow(shapes)
        if self.joints:
            clamp = getattr(self, "clamp", {})
            at_clamps = [way for group, ways in self.joints.items() if group in clamp for way in ways]
            elsewhere = {group: ways for group, ways in self.joints.items() if group not in clamp}
            F = np.column_stack([F, load_vectors(structure, at_clamps, elsewhere)])
        attachment, loads = getattr(self, "attachment", []), getattr(self, "loads", {})
        return with_attachment(structure, shapes, attachment, loads, F) if attachment or loads or F.size else shapes

    def shapes(
        self,
        structure: Structure,
        modes: int | None = None,
        slow: Slow | None = None,
        where: str = "",
        bends_far: bool = False,
    ) -> tuple[Structure, ModeSet]:
        """The structure and its set, with the derivatives and responses; `where` begins warnings.

        bends_far: whether the strain is one of large deflections
        """
        shapes = self.vibration_set(structure, modes, slow)
        if self.third_derivatives or bends_far:
            shapes = with_sheet_shapes(structure, shapes, self.third_derivatives, self.deflection)
        if self.derivatives not in (None, "none", 0):
            deflection = None if self.responses else self.deflection
            shapes = with_static_derivatives(structure, shapes, self.derivatives, deflection, where)
        if self.responses and self.deflection is not None:
            directions = [direction for direction in getattr(self, "attachment", ()) if direction in "xyz"]
            loads = getattr(self, "loads", {})
            shapes = with_responses(structure, shapes, self.responses, self.deflection, directions, loads)
        return structure, shapes


class Cantilever(Stretchable):
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
    def _has_a_clamp(self) -> Cantilever:
        if not self.clamp:
            refuse(
                "found no group to clamp; cantilever modes are those of a clamped structure, so name a group, or use "
                "method = 'free_free'"
            )
        return self

    def modes_alone(self, structure: Structure, n: int) -> ModeSet:
        """The n lowest modes of the clamped structure."""
        return cantilever_modes(structure, clamp_of(self.clamp), n)


class FreeFree(Stretchable):
    """Elastic modes of the unconstrained structure; the body frame follows the mean motion."""

    method: Literal["free_free"]
    """Selects this reduction: elastic modes of the unconstrained structure."""
    modes: Whole
    """Number of elastic modes kept, the lowest first; rigid-body modes do not count."""

    def modes_alone(self, structure: Structure, n: int) -> ModeSet:
        """The n lowest elastic modes of the free structure."""
        return free_free_modes(structure, n)


class CraigBampton(Stretchable):
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

    def modes_alone(self, structure: Structure, n: int) -> ModeSet:
        """The constraint modes, and n modes with the interfaces fixed."""
        return craig_bampton(structure, self.interfaces, n, clamp_of(self.clamp), self.interface)


class Nodal(Table):
    """The nodal displacements themselves, with groups clamped: no reduction."""

    method: Literal["nodal"]
    """Selects this reduction: every nodal displacement is a coordinate."""
    clamp: Clamp
    """Groups clamped in the body frame, written as for cantilever modes."""

    def shapes(self, structure: Structure, *_: object) -> tuple[Structure, ModeSet]:
        """The structure and its nodal displacements."""
        return structure, nodal(structure, clamp_of(self.clamp))


class Lumped(Table):
    """Nodal translations with lumped masses; rotations condensed out."""

    method: Literal["lumped"]
    """Selects this reduction: nodal translations with lumped masses."""
    clamp: Clamp
    """Groups clamped in the body frame, written as for cantilever modes."""

    def shapes(self, structure: Structure, *_: object) -> tuple[Structure, ModeSet]:
        """The structure with lumped masses and its nodal translations."""
        structure = lumped(structure)
        return structure, nodal_translations(structure, clamp_of(self.clamp))


class Stiff(Table):
    """No elastic coordinates: the mesh gives mass, inertia and picture."""

    method: Literal["rigid"]
    """Selects this reduction: a rigid body."""

    def shapes(self, structure: Structure, *_: object) -> tuple[Structure, ModeSet]:
        """The structure and a set without shapes."""
        return structure, rigid_set(structure.n_dof)


def with_static_derivatives(
    structure: Structure, modes: ModeSet, keep: int | str, deflection: float | None, where: str
) -> ModeSet:
    """The set with `keep` static derivatives added. Warns if there are fewer independent ones than requested."""
    extended = with_derivatives(structure, modes, keep, deflection)
    added = extended.n_modes - modes.n_modes
    if isinstance(keep, int) and added < keep:
        source = "its states bent so far" if deflection else f"the pairs of its {modes.n_modes} shapes"
        warn_of_physics(
            "{body_or_joint}: {limit} derivatives are requested, but {states} give only {value} independent ones. "
            "These are used;",
            body_or_joint=where,
            value=added,
            limit=keep,
            remedy="set derivatives = {value}",
            states=source,
        )
    return extended


def clamp_of(groups: Mapping[str, Support]) -> list[str] | dict[str, Support]:
    """The group names if all components of all groups are clamped, else group -> support."""
    return list(groups) if all(support.is_clamped for support in groups.values()) else dict(groups)


Reduction = Annotated[
    Cantilever | FreeFree | CraigBampton | Nodal | Lumped | Stiff,
    Field(discriminator="method"),
]
