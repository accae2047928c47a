"""[bodies.<name>] of kind "matrices": a body from mass and stiffness matrices of another program."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from femflex.case.body_base import BodyTable
from femflex.noun.inertia import InertiaMatrix
from femflex.noun.table import Name, Table, refuse
from femflex.noun.values import Direction, Mass, Position, Quantity, Whole
from femflex.reduction.methods import Reduction
from femflex.reduction.nouns import DampingTable

ELEMENTS_ONLY = ("derivatives", "third_derivatives", "deflection", "responses", "spin")


class MatrixNamesTable(Table):
    """Names of the matrices in their files. Default: those that the formats use, such as MAAX, MAA, M."""

    mass: str | None = None
    """Name of the mass matrix."""
    stiffness: str | None = None
    """Name of the stiffness matrix."""
    damping: str | None = None
    """Name of the damping matrix."""
    geometric: str | None = None
    """Name of the geometric stiffness matrix."""


class MatrixFilesTable(Table):
    """Files of the matrices, the coordinates of nodes and the map of degrees of freedom, relative to the case file."""

    file: str | None = None
    """File that has all matrices: .npz, .h5, .mat, .op4, .op2, .pch, .bdf."""
    mass: str | None = None
    """File of the mass matrix alone, such as an .mtx."""
    stiffness: str | None = None
    """File of the stiffness matrix alone."""
    damping: str | None = None
    """File of the damping matrix alone. Default: none."""
    geometric: str | None = None
    """File of a geometric stiffness matrix of a steady stress, which is added to the stiffness. Default: none."""
    nodes: str | None = None
    """File with the coordinates of the nodes: .csv (number, x, y, z), Nastran GRID cards, an Abaqus input file, or
    arrays. Default: those of `file`."""
    dofs: str | None = None
    """Map of degrees of freedom: a file with node and component 1 to 6 per row, or "xyz" or "xyzrxryrz", the same
    components at every node in their order. Default: that of the files, or three or six a node by the size."""
    names: MatrixNamesTable = Field(default_factory=MatrixNamesTable)
    """Names of the matrices in their files."""

    @model_validator(mode="after")
    def _has_mass_and_stiffness(self) -> MatrixFilesTable:
        if self.file is None and (self.mass is None or self.stiffness is None):
            refuse("found neither file nor both of mass and stiffness; name the files that hold the matrices")
        return self


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
    matrices: str | MatrixFilesTable
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
    damping: DampingTable | None = None
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
        entries = self.matrices.model_dump(exclude={"names"})
        return tuple((f".{key}", name) for key, name in entries.items() if name and name not in ("xyz", "xyzrxryrz"))

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
