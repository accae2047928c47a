"""Local directions of an Abaqus deck: *ORIENTATION of materials, *TRANSFORM of nodes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array
from femflex.decks.abaqus.model import AbaqusModel
from femflex.decks.axes import Axes
from femflex.mesh.formats.abaqus_flat import InstanceKeyword, Placement
from femflex.mesh.formats.abaqus_keywords import Keyword


@dataclass(frozen=True, eq=False)
class System(Axes):
    """Directions 1, 2, 3, with an additional rotation.

    about     axis (0 to 2) of the additional rotation, which is the normal of shells; None: not given
    angle     [rad]
    """

    about: int | None = None
    angle: float = 0.0

    def axes_at(self, point: Array) -> Array:
        """Directions as rows at a point (3,) [m], including the additional rotation."""
        rows = self.unrotated_axes(point)
        if self.about is None or not self.angle:
            return rows
        c, s = np.cos(self.angle), np.sin(self.angle)
        i, j = (self.about + 1) % 3, (self.about + 2) % 3
        rotated = rows.copy()
        rotated[i], rotated[j] = c * rows[i] + s * rows[j], c * rows[j] - s * rows[i]
        return rotated

    def unrotated_axes(self, point: Array) -> Array:
        """Directions as rows at a point (3,) [m], without the additional rotation; spherical ones: radial, around the
        polar axis, towards it."""
        rows = super().axes_at(point)
        return np.stack([rows[0], rows[2], -rows[1]]) if self.kind == "S" else rows

    def on_surface(self, x: Array, normal: Array) -> Array:
        """Direction 1 of a shell's material at x (3,) [m], a unit vector (3,) in the surface: the projection of
        the axis after the one along the normal."""
        rows = self.unrotated_axes(x)
        k = self.about if self.about is not None else int(np.argmax(np.abs(rows @ normal)))
        for candidate in (rows[(k + 1) % 3], rows[(k + 2) % 3], rows[k]):
            flat = candidate - (candidate @ normal) * normal
            if np.linalg.norm(flat) > 1e-3:
                break
        flat = flat / np.linalg.norm(flat)
        return np.asarray(np.cos(self.angle) * flat + np.sin(self.angle) * np.cross(normal, flat))

    def in_assembly(self, placement: Placement, length: float) -> System:
        """The system of a part, moved with the placement of its instance."""
        origin = placement.assembly_position(self.origin / length) * length
        return replace(self, C=self.C @ placement.C.T, origin=origin)


def system_of(values: Array, kind: str, length: float, keyword: Keyword) -> System:
    """The System of points a and b (3,) in the deck's unit of length, and of the origin c if given. Raises ValueError
    if they lie on a line."""
    a, b, c = np.pad(values, (0, max(0, 9 - len(values))))[:9].reshape(3, 3)
    if kind == "R":
        x, y = a - c, b - c
    else:
        z = b - a
        c = a
        x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 * np.linalg.norm(z) else [1.0, 0, 0], z)
        y = np.cross(z, x)
    n = np.cross(x, y)
    if not np.linalg.norm(n) > 1e-12 * max(float(np.linalg.norm(x) * np.linalg.norm(y)), 1e-300):
        raise keyword.error(
            f"has points {values.tolist()}, which give no directions, as they lie on a line; correct them.", 0
        )
    x, n = x / np.linalg.norm(x), n / np.linalg.norm(n)
    return System(kind, c * length, np.stack([x, np.cross(n, x), n]))


def read_orientations(model: AbaqusModel) -> dict[tuple[str, str], System]:
    """Systems of *ORIENTATION by instance and name, in capitals."""
    systems: dict[tuple[str, str], System] = {}

    def add(entry: InstanceKeyword) -> None:
        scope, keyword = entry
        kind = (keyword.parameter("system") or "R").upper()[0]
        definition = keyword.parameter("definition").upper() or "COORDINATES"
        if definition not in ("COORDINATES", "NODES") or kind not in "RCS" or not keyword.data:
            raise keyword.error(
                f"with DEFINITION={definition}, SYSTEM={kind} is not read; give points (COORDINATES) of a "
                "rectangular, cylindrical or spherical system."
            )
        first = next((k for k, row in enumerate(keyword.data) if _number(row[0])), None)
        if first is None:
            raise keyword.error("by *DISTRIBUTION alone has no directions; give points.")
        if first:
            model.findings.note(
                f"{keyword.location()}: a distribution of orientations is left out; its default is used"
            )
        words = [word for word in keyword.data[first] if word]
        if definition == "NODES":
            nodes = [model.node_of(word, scope, keyword, first) for word in words]
            values = np.concatenate([model.flat.nodes[node] for node in nodes])
        else:
            values = np.array([keyword.real(word, first, "a coordinate") for word in words])
        system = system_of(values, kind, model.units.length, keyword)
        rotation_rows = keyword.data[first + 1 :]
        if rotation_rows:
            axis = keyword.integer(rotation_rows[0][0] or "1", first + 1, "an axis") - 1
            angle = keyword.real(rotation_rows[0][1], first + 1, "an angle") if len(rotation_rows[0]) > 1 else 0.0
            system = replace(system, about=axis % 3, angle=float(np.radians(angle)))
        if definition != "NODES":  # positions of nodes are already those of the assembly
            system = system.in_assembly(model.placement(scope), model.units.length)
        systems[scope.upper(), keyword.parameter("name").upper()] = system

    model.for_each_keyword(add, "ORIENTATION")
    return systems


def read_transforms(model: AbaqusModel) -> dict[int, System]:
    """Systems of *TRANSFORM by node."""
    systems: dict[int, System] = {}

    def add(entry: InstanceKeyword) -> None:
        scope, keyword = entry
        kind = (keyword.parameter("type") or "R").upper()[0]
        values = np.array([keyword.real(word, 0, "a coordinate") for row in keyword.data for word in row if word])
        system = system_of(values, kind, model.units.length, keyword).in_assembly(
            model.placement(scope), model.units.length
        )
        for node in model.nodes_of(keyword.parameter("nset"), scope, keyword):
            systems[model.representative(node)] = system

    model.for_each_keyword(add, "TRANSFORM")
    return systems


def _number(word: str) -> bool:
    try:
        float(word.upper().replace("D", "E"))
    except ValueError:
        return False
    return True
