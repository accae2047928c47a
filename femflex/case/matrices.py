"""[bodies.<name>] of kind "matrices": a body from mass and stiffness matrices of another program."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from femflex.case.body_base import BodyTable
from femflex.matrices.read import Sources
from femflex.noun.inertia import InertiaMatrix
from femflex.noun.table import Name, Table, refuse
from femflex.noun.values import Direction, Mass, Position, Quantity, Whole
from femflex.reduction.methods import Reduction
from femflex.reduction.modes.damping import Damping

ELEMENTS_ONLY = ("derivatives", "third_derivatives", "deflection", "responses", "spin")


class SpinTable(Table):
    """The steady spin that a geometric stiffness matrix belongs to."""

    rate: Annotated[float, Quantity("rad/s", above=0.0)]
    """Rate of the spin for which the geometric stiffness was computed."""
    axis: Direction
    """Direction of its axis in the body frame."""


class MatricesTable(BodyTable):
    """A body from mass and stiffness matrices with node coordinates; its strain is linear."""

    kind: Literal["matrices"]
    """Selects this body: mass and stiffness matrices from files."""
    matrices: str | Sources
    """File with matrices, coordinates and map of degrees of freedom, relative to the case file; or a table of files."""
    units: str = "m-kg-s"
    """Units of the files: length-mass-time or length-force-time, such as "mm-t-s" or "in-lbf-s"."""
    groups: dict[Name, list[Whole]] = Field(default_factory=dict)
    """Name -> numbers of nodes. Without, node_17 and all are names too."""
    reduction: Reduction | None = None
    """Shapes that the body may take. Default, only for reduced models: all of their modes, with the first node as
    reference."""
    spin: SpinTable | None = None
    """Spin that the geometric stiffness belongs to: it then grows with the square of the rate about that axis. Left
    out: the geometric stiffness is constant."""
    damping: Damping | None = None
    """Structural damping, in place of the damping matrix. Default: the damping matrix, or none."""
    mass: Mass | None = None
    """Mass that the matrices are checked against. Default: not checked."""
    center_of_mass: Position | None = None
    """Centre of mass that the matrices are checked against. Default: not checked."""
    inertia: InertiaMatrix | None = None
    """Inertia about the centre of mass that the matrices are checked against. Default: not checked."""

    @property
    def files(self) -> tuple[tuple[str, str], ...]:
        """(key, file) of all files of the table, key after `matrices`."""
        if isinstance(self.matrices, str):
            return (("", self.matrices),)
        return tuple((f".{key}", name) for key, name in self.matrices.files)

    @model_validator(mode="after")
    def _has_no_strain_keys(self) -> MatricesTable:
        settings: dict[str, Any] = {key: getattr(self.reduction, key, None) for key in ELEMENTS_ONLY}
        present = [key for key, value in settings.items() if value not in (None, "none", 0, False)]
        if present:
            refuse(
                f"found {', '.join(present)} in the reduction of a body from matrices, whose strain is linear: "
                "matrices hold no strain beyond that; drop it, or make the body of elements (kind = 'flexible')"
            )
        if getattr(self.reduction, "method", "") == "lumped":
            refuse("found method 'lumped' for a body from matrices; its mass matrix is given, so use 'nodal'")
        for name, marker in self.markers.items():
            if marker.position is not None:
                refuse(f"found position in marker {name!r} of a body from matrices; give a group, such as 'node_17'")
        return self
