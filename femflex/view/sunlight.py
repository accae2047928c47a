"""Sunlight on the bodies of a scene: cells of the drawn faces, each side coloured by the light that it receives.

The light is the cosine to the sun times the lit share (`kernels.visibility`) times the visible share of the sun's disc.
Shapes cast shadow as they are drawn, magnified if that is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.kernels.visibility import axes_across, lit_moments
from femflex.results import Run
from femflex.view.motion import Motion
from femflex.view.overlay import pose_matrix
from femflex.view.surface import Surface
from femflex.view.surroundings import sun_of
from femflex.view.theme import Theme
from femflex.view.units import Bar

LIGHT = "light"  # the colour of pictures
CELL = 1.0 / 300.0  # side of a cell, parts of the picture's height
MOST = 60_000  # cells of a scene, about, into which faces are divided; their lit shares take 0.2 s


def sunlight_bar(run: Run) -> Bar:
    """The colour bar of light. Raises ValueError for a run without a sun."""
    if sun_of(run) is None:
        raise ValueError(
            f"colour 'light' needs the direction to the sun, and {run.path.name} has none; add a table "
            '[surroundings.sun] with kind = "sun" to the case, and run it again.'
        )
    return Bar(1.0, "", 1.0, 5, title="sunlight")


class Sunlight:
    """The faces of all bodies of a scene, coloured by the light on them at the instant that is shown."""

    def __init__(self, plotter: Any, surfaces: Mapping[str, Surface], metre: float, theme: Theme) -> None:
        """metre: size of one in the middle of the scene, parts of the picture's height."""
        with_faces = {name: each for name, each in surfaces.items() if len(each.triangles) + len(each.quads)}
        area = sum(float(_sides(each).prod(axis=1).sum()) for each in with_faces.values())
        size = max(CELL / metre, np.sqrt(area / MOST))
        self._faces = {name: SunlitFaces(plotter, each, size, theme) for name, each in with_faces.items()}

    def show(self, moving: Motion, k: int, scale: float) -> None:
        """Show instant k of a motion, its elastic displacement magnified."""
        cells = [
            faces.show(moving.position[name][k], moving.attitude[name][k], moving.delta[name][k], scale)
            for name, faces in self._faces.items()
        ]
        closed = [faces.closed for faces in self._faces.values()]
        for faces, light in zip(
            self._faces.values(), light_on(cells, closed, moving.directions["sun"][k]), strict=True
        ):
            faces.paint(moving.sun_share[k] * light)


class SunlitFaces:
    """The faces of one body as cells with one pose, deformed in place; those of a sheet have two sides."""

    def __init__(self, plotter: Any, surface: Surface, size: float, theme: Theme) -> None:
        """size: of cells [m]."""
        import pyvista as pv

        self.closed, self._points = surface.closed, surface.skin
        self._weights, self._cells = divided(surface, size)
        sides = self._cells if self.closed else np.concatenate([self._cells, self._cells[:, ::-1]])
        table = np.column_stack([np.full(len(sides), 4), sides]).ravel()
        self._data: Any = pv.PolyData(self._weights @ self._points.reference, faces=table)
        self._data.cell_data["sunlight"] = np.zeros(len(sides), np.float32)
        self._actor = plotter.add_mesh(
            self._data, scalars="sunlight", preference="cell", cmap=theme.light_map(), clim=(0.0, 1.0), lighting=False,
            culling="back", show_scalar_bar=False, reset_camera=False,
        )  # fmt: skip

    def show(self, position: Array, attitude: Array, delta: Array, scale: float) -> Array:
        """Move to a pose with elastic coordinates, as `BodyActor.show`; corners of the cells (k, 4, 3) [m] there."""
        points = self._weights @ self._points.displaced(delta, scale)[0]
        self._actor.SetUserMatrix(pose_matrix(position, attitude))
        self._data.points[:] = points
        self._data.GetPoints().Modified()
        return np.asarray((position + points.astype(float) @ attitude.T)[self._cells])

    def paint(self, light: Array) -> None:
        """Colour the cells by the light (k,) [1] on their fronts, and by minus it on their backs."""
        self._data.cell_data["sunlight"][:] = light if self.closed else np.concatenate([light, -light])
        self._data.GetCellData().GetArray("sunlight").Modified()
        self._data.Modified()


def light_on(cells: Sequence[Array], closed: Sequence[bool], sun: Array) -> Iterator[Array]:
    """Light (k,) on the cells of each body: cosine times lit share, negative where it falls on their backs.

    cells   (k, 4, 3)  corners [m] of each body, of a triangle the last one twice; counter-clockwise seen from the front
    closed  of each body: whether its backs are inside, where no light falls
    sun     (3,)  unit vector to the sun, in the axes of the corners
    """
    if not cells:
        return
    count = [len(each) for each in cells]
    corners, n = np.concatenate(cells), sum(count)
    body, inside = np.repeat(np.arange(len(cells)), count), np.repeat(np.asarray(closed, np.int64), count)
    numbers = np.column_stack([np.zeros(n, np.int64), np.arange(n), body, inside])
    moments = lit_moments(corners, np.zeros(n), np.zeros(n), numbers, axes_across(sun)[None], np.zeros((1, 3)), n)
    whole, lit = moments[:, :, 0].T
    area = _area_vectors(corners)
    size = np.linalg.norm(area, axis=1) * np.where(whole > 0.0, whole, 1.0)
    light = lit * (area @ sun) / np.where(size > 0.0, size, 1.0)
    yield from np.split(light, np.cumsum(count)[:-1])


def divided(surface: Surface, size: float) -> tuple[sparse.csr_array, IntArray]:
    """Weights (n, n_p) of the points of cells, from those of a surface, and cells (k, 4) of its divided faces.

    The sides of cells are about `size` [m] long, or those of their faces. Strips of a triangle meet in one corner.
    """
    corners = _faces(surface)
    parts = np.maximum(np.rint(_sides(surface) / size), 1.0).astype(np.int64)
    weights, points, cells, n = [], [], [], 0
    for n_u, n_v in np.unique(parts, axis=0):
        group = corners[np.all(parts == (n_u, n_v), axis=1)]
        u, v = (each.ravel() for each in np.meshgrid(*(np.linspace(0, 1, m + 1) for m in (n_u, n_v)), indexing="ij"))
        at = np.arange(len(u)).reshape(n_u + 1, n_v + 1)
        cell = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
        weight = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)
        weights.append(np.tile(weight, (len(group), 1)))
        points.append(np.repeat(group, len(u), axis=0))
        cells.append((n + len(u) * np.arange(len(group))[:, None, None] + cell).reshape(-1, 4))
        n += len(u) * len(group)
    columns = np.concatenate(points)
    entries = np.concatenate(weights).astype(np.float32).ravel(), (np.repeat(np.arange(n), 4), columns.ravel())
    return sparse.csr_array(entries, shape=(n, len(surface.skin.reference))), np.concatenate(cells)


def _faces(surface: Surface) -> IntArray:
    """Corners (n_faces, 4) of the faces; those of a triangle from its shortest side on, the last one twice."""
    x = surface.skin.reference[surface.triangles]
    shortest = np.argmin(np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2), axis=1)
    turned = np.take_along_axis(surface.triangles, (shortest[:, None] + np.array([0, 1, 2, 2])) % 3, axis=1)
    return np.concatenate([turned, surface.quads])


def _sides(surface: Surface) -> Array:
    """The longer ones (n_faces, 2) of the first and third, and of the second and fourth side of each face [m]."""
    x = surface.skin.reference[_faces(surface)].astype(float)
    length = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2)
    return np.asarray(np.maximum(length[:, :2], length[:, 2:]))


def _area_vectors(corners: Array) -> Array:
    """Area vectors (k, 3) [m^2] of cells from their corners (k, 4, 3) [m]."""
    return np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]) / 2
