"""Bodies and traces as actors whose points are updated in place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, IntArray
from femflex.view.overlay import pose_matrix
from femflex.view.paint import Paint
from femflex.view.surface import Points, Surface
from femflex.view.theme import Theme
from femflex.view.units import Bar
from femflex.view.window import LIGHTS

THIN, FAINT, THICK, DOT = 1.1, 0.8, 4.0, 9.0  # pixels: edges of faces, mesh lines, lines and points as bodies
PALE = 0.6  # opacity of mesh lines
WRAP = 0.3  # light reaches faces turned away up to this cosine, so that colours on the dark side are visible
VEIL = 0.16  # opacity


class BodyActor:
    """One body in a scene: faces, edges, lines and dots with one pose, deformed in place."""

    def __init__(
        self,
        plotter: Any,
        surface: Surface,
        colour: str,
        theme: Theme,
        bar: Bar | None,
        pixel: float,
        paint: Paint | None = None,
    ) -> None:
        """Coloured over the bar by the length of the displacement, or by a paint where one is given."""
        self._surface, self._bar, self._paint = surface, bar, paint
        self._delta: Array | None = None
        self._data = _drawn_parts(surface)
        self._actors = []
        for kind, data in self._data.items():
            plain = theme.edge if kind in ("edges", "mesh") else colour
            look: dict[str, Any] = {"color": plain}
            if bar is not None and kind != "edges":
                data.point_data["painted"] = np.zeros(data.n_points, np.float32)
                cmap = theme.mesh_line_map(bar.signed) if kind == "mesh" else theme.colour_map(bar.signed)
                look = {"scalars": "painted", "cmap": cmap, "clim": bar.limits, "nan_color": plain}
            actor = plotter.add_mesh(data, show_scalar_bar=False, smooth_shading=False, reset_camera=False, **look)
            _style(actor, kind, pixel, surface.closed)
            self._actors.append(actor)

    def show(
        self, position: Array, attitude: Array, delta: Array, scale: float, own_amplitudes: Array | None = None
    ) -> None:
        """Move to a pose, position (3,) [m] and C_VB (3, 3), with elastic coordinates (n,) magnified.

        own_amplitudes: amplitudes of the body's own shapes, for a paint, where they differ from delta.
        """
        pose = pose_matrix(position, attitude)
        for actor in self._actors:
            actor.SetUserMatrix(pose)
        if self._delta is None or not np.array_equal(delta, self._delta):
            self._delta = np.array(delta)
            self._deform(self._delta, scale, self._delta if own_amplitudes is None else own_amplitudes)

    @property
    def is_drawn(self) -> bool:
        """Whether the body has any faces, edges, lines or dots of its own."""
        return bool(self._actors)

    @property
    def centre(self) -> Array:
        """Middle (3,) of the box around the body as it is drawn, in the camera's frame [m]."""
        boxes = np.array([actor.GetBounds() for actor in self._actors]).reshape(-1, 3, 2)
        return np.asarray((boxes[..., 0].min(axis=0) + boxes[..., 1].max(axis=0)) / 2)

    def rescale(self, top: float) -> None:
        """Colour from none to this displacement [m], where the displacement colours."""
        if self._bar is not None and self._paint is None:
            for actor in self._actors:
                actor.mapper.SetScalarRange(0.0, top * self._bar.factor)

    def _deform(self, delta: Array, scale: float, own_amplitudes: Array) -> None:
        painted = None if self._paint is None else self._paint.values(own_amplitudes)
        for kind, data in self._data.items():
            points, length = _points(self._surface, kind).displaced(delta, scale)
            data.points[:] = points
            data.GetPoints().Modified()
            if kind == "faces":
                data.point_data["Normals"][:] = self._surface.normals(points)
                data.GetPointData().GetNormals().Modified()
            if self._bar is not None and kind != "edges":
                colour_values = length if painted is None else painted[_points(self._surface, kind).numbers]
                data.point_data["painted"][:] = colour_values * np.float32(self._bar.factor)
                data.GetPointData().GetArray("painted").Modified()
            data.Modified()


def add_ghost(plotter: Any, surface: Surface, theme: Theme, pixel: float) -> list[Any]:
    """Draw the undeformed body, transparent with its sharp edges; return its actors, at the identity pose."""
    actors = []
    for kind, data in _drawn_parts(surface).items():
        if kind == "mesh":
            continue
        actor = plotter.add_mesh(data, color=theme.ghost, smooth_shading=False, reset_camera=False)
        _style(actor, kind, pixel, surface.closed)
        actor.prop.opacity = VEIL if kind == "faces" else 0.9
        actor.prop.line_width = pixel * THIN
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(
            2.0, 4.0
        )  # behind the surfaces that it touches
        actors.append(actor)
    return actors


class LineActor:
    """A line through points that move: the path of a marker, a line of sight, or a cable."""

    def __init__(self, plotter: Any, count: int, theme: Theme, width: float, colour: Any = None) -> None:
        """count: number of points;  width [pixels];  colour: default that of paths."""
        import pyvista as pv

        self._data: Any = pv.PolyData(np.zeros((count, 3), np.float32), lines=_vtk_cells(np.arange(count)[None, :]))
        plotter.add_mesh(
            self._data,
            color=theme.trace if colour is None else colour,
            line_width=width,
            lighting=False,
            reset_camera=False,
        )

    def show(self, points: Array) -> None:
        """Draw it through points (count, 3) [m]."""
        self._data.points[:] = points
        self._data.GetPoints().Modified()
        self._data.Modified()


def _drawn_parts(surface: Surface) -> dict[str, Any]:
    import pyvista as pv

    cells = {
        "faces": {"faces": _vtk_cells(surface.triangles, surface.quads)},
        "edges": {"lines": _vtk_cells(surface.edges)},
        "mesh": {"lines": _vtk_cells(surface.mesh)},
        "lines": {"lines": _vtk_cells(surface.lines)},
        "dots": {"verts": _vtk_cells(surface.dots[:, None])},
    }
    filled = {kind: table for kind, table in cells.items() if all(len(values) for values in table.values())}
    data_by_kind: dict[str, Any] = {}
    for kind, table in filled.items():
        make: Any = pv.PolyData
        data_by_kind[kind] = make(_points(surface, kind).reference.copy(), **table)
    if "faces" in data_by_kind:
        data_by_kind["faces"].point_data["Normals"] = surface.normals(surface.skin.reference)
        data_by_kind["faces"].GetPointData().SetActiveNormals("Normals")
    return data_by_kind


def _points(surface: Surface, kind: str) -> Points:
    return surface.skin if kind == "faces" else surface.wires


def _style(actor: Any, kind: str, pixel: float, closed: bool) -> None:
    style = actor.prop
    style.ambient, style.diffuse = 0.36, 0.66
    if kind == "faces":
        style.interpolation = "Phong"
        style.culling = "back" if closed else "none"
        actor.GetShaderProperty().AddFragmentShaderReplacement("//VTK::Light::Impl", True, matt_shading(), False)
        return
    style.lighting = False
    style.line_width = pixel * {"edges": THIN, "mesh": FAINT}.get(kind, THICK)
    style.opacity = PALE if kind == "mesh" else 1.0
    style.point_size = pixel * DOT
    style.render_points_as_spheres = kind == "dots"
    actor.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, -4.0)


def matt_shading() -> str:
    """The shader's lines for matt surfaces under LIGHTS; VTK's own, with gloss, take a quarter of a frame's time."""
    shade = []
    for direction, intensity in LIGHTS:
        x, y, z = (float(c) for c in np.divide(direction, np.linalg.norm(direction)))
        facing = f"dot(normalVCVSOutput, vec3({x:.4f}, {y:.4f}, {z:.4f}))"
        shade.append(f"{intensity / (1.0 + WRAP):.4f} * max(0.0, {facing} + {WRAP:.4f})")
    return f"  fragOutput0 = vec4(ambientColor + ({' + '.join(shade)}) * diffuseColor, opacity);\n"


def _vtk_cells(*tables: NDArray[Any]) -> IntArray:
    rows = [np.column_stack([np.full(len(table), table.shape[1]), table]).ravel() for table in tables]
    return np.concatenate(rows).astype(np.int64)
