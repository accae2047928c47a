"""Texts, colour bar and corner triad over a scene."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femflex.arrays import Array
from femflex.view.framing import View
from femflex.view.theme import Theme
from femflex.view.units import Bar, length_unit, round_below

if TYPE_CHECKING:
    from matplotlib.colors import ListedColormap

CORNER = (0.19, 0.175)  # centre of the corner triad from the left and the bottom, parts of the height
CORNER_ARM = 0.075  # length of its axes
LETTER = 0.023  # height of letters
NAME, NAME_VEIL = 0.021, 0.6  # height of names of bodies, parts of the height; opacity behind them
END_ON = 0.15  # sine of the angle to the line of sight below which an axis is a dot, named below it
BAR_WIDTH = 0.15  # of the colour bar with its numbers, parts of the height
BAR_HEIGHT = (0.22, 0.74)  # its ends
SCALE_PLACE = (0.345, 0.07)  # middle of the length scale, parts of width and height
SCALE_REACH = 0.3  # its greatest length, parts of the height


def add_text(
    renderer: Any,
    text: str,
    position: tuple[float, float],
    pixels: float,
    colour: str,
    align: str = "left top",
    bold: bool = False,
) -> Any:
    """Add a text at a position in fractions of width and height; return its actor."""
    import pyvista as pv

    actor: Any = pv.Text(text)
    actor.prop = _text_property(round(pixels), colour, bold, align)
    actor.GetPositionCoordinate().SetCoordinateSystemToNormalizedViewport()
    actor.SetPosition(*position)
    renderer.AddViewProp(actor)
    return actor


def add_colour_bar(plotter: Any, bar: Bar, colours: ListedColormap, theme: Theme, size: tuple[int, int]) -> None:
    """A labelled bar of these colours at the right rim."""
    import pyvista as pv

    (low, high), width, pixels = BAR_HEIGHT, BAR_WIDTH * size[1] / size[0], round(size[1] * LETTER)
    title = f"{bar.title}\n[{bar.unit}]" if bar.unit else bar.title
    mapper, text = pv.DataSetMapper(pv.PolyData()), _text_property(pixels, theme.text)
    mapper.lookup_table = pv.LookupTable(cmap=colours, scalar_range=bar.limits)
    place = {"position_x": 0.99 - width, "position_y": low, "width": width, "height": high - low + 0.1}
    form = {"vertical": True, "n_labels": bar.steps + 1, "fmt": bar.form, "unconstrained_font_size": True}
    actor = plotter.add_scalar_bar(f"{title}\n", mapper=mapper, **place, **form)
    actor.SetTitleTextProperty(text)
    actor.SetLabelTextProperty(text)


def add_length_scale(renderer: Any, metre: float, theme: Theme, size: tuple[int, int]) -> None:
    """A ruler of a round length at the bottom; metre: size of one in the middle of the scene, parts of the height."""
    import pyvista as pv
    from vtkmodules.vtkRenderingAnnotation import vtkAxisActor2D

    length = round_below(SCALE_REACH / metre)
    half, (middle, low) = 0.5 * length * metre * size[1] / size[0], SCALE_PLACE
    factor, unit = (1.0, "m") if length >= 1.0 else length_unit(length)
    ruler = vtkAxisActor2D()
    ruler.SetPoint1(middle - half, low)
    ruler.SetPoint2(middle + half, low)
    ruler.SetTitle(f"{length * factor:g} {unit}")
    ruler.SetTitleTextProperty(_text_property(round(size[1] * LETTER), theme.text))
    ruler.AdjustLabelsOff()
    ruler.SetNumberOfLabels(2)
    ruler.LabelVisibilityOff()
    ruler.SetTickLength(round(size[1] / 60))
    ruler.UseFontSizeFromPropertyOn()
    ruler.GetProperty().SetColor(*pv.Color(theme.text).float_rgb)
    renderer.AddViewProp(ruler)


def _text_property(pixels: int, colour: str, bold: bool = False, align: str = "center center") -> Any:
    import pyvista as pv

    across, upward = align.split()
    look: Any = {"color": colour, "justification_horizontal": across, "justification_vertical": upward}
    return pv.TextProperty(font_file=_font(bold), font_size=max(6, pixels), **look)


@cache
def _font(bold: bool) -> str:
    """The file of a font that has every sign used, and comes with matplotlib."""
    import matplotlib

    return str(Path(matplotlib.get_data_path(), "fonts", "ttf", "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"))


class BodyNames:
    """Names of bodies over the scene, at the middle of each, moved up or down where they would cover each other."""

    def __init__(self, renderer: Any, names: Sequence[str], theme: Theme, size: tuple[int, int]) -> None:
        import pyvista as pv

        self._aspect, self._labels = size[0] / size[1], {}
        for name in names:
            actor = add_text(renderer, name, (0, 0), size[1] * NAME, theme.text, "center center")
            actor.prop.SetBackgroundColor(*pv.Color(theme.background).float_rgb)
            actor.prop.SetBackgroundOpacity(NAME_VEIL)
            self._labels[name] = actor

    def show(self, view: View, centres: dict[str, Array]) -> None:
        """Move to the middles (3,) of the bodies in the camera's frame [m]."""
        used: list[Array] = []
        for name, actor in self._labels.items():
            half = np.array([0.36 * NAME * (len(name) + 1) / self._aspect, 0.75 * NAME])
            place = view.on_screen(centres[name][None], self._aspect)[0]
            steps = (place + np.array([0.0, 2 * half[1] * step]) for step in sorted(range(-8, 9), key=abs))
            free = (p for p in steps if all((np.abs(p - other[0]) >= half + other[1]).any() for other in used))
            place = np.clip(next(free, place), half, 1 - half)
            used.append(np.stack([place, half]))
            actor.SetPosition(*place)


class CornerTriad:
    """Axes of the reference frame in the lower left corner, turning with it, and arrows to sun and along fields."""

    def __init__(
        self,
        plotter: Any,
        view: View,
        names: tuple[str, ...],
        theme: Theme,
        size: tuple[int, int],
        letter: float = LETTER,
    ) -> None:
        """names: of the three axes, then of the arrows;  letter: height of the names, parts of the picture's."""
        from vtkmodules.vtkRenderingCore import vtkRenderer

        colours = (*theme.axes, *(theme.directions[name] for name in names[3:]))
        self._axes, self._aspect = view.axes, size[0] / size[1]
        centre, half = (CORNER[0] / self._aspect, CORNER[1]), (CORNER[1] / self._aspect, CORNER[1])
        renderer = vtkRenderer()
        renderer.SetViewport(centre[0] - half[0], centre[1] - half[1], centre[0] + half[0], centre[1] + half[1])
        renderer.SetLayer(1)
        renderer.InteractiveOff()
        plotter.render_window.SetNumberOfLayers(2)
        plotter.render_window.AddRenderer(renderer)
        self._actor = arrows_actor(theme.axes, np.ones(3), thickness=0.07)
        self._arrows = [arrows_actor([colour], np.ones(1), 0.07) for colour in colours[3:]]
        for actor in (self._actor, *self._arrows):
            renderer.AddViewProp(actor)
        camera = renderer.GetActiveCamera()
        camera.SetParallelProjection(True)
        camera.SetParallelScale(CORNER[1] / CORNER_ARM)
        camera.SetFocalPoint(0.0, 0.0, 0.0)
        camera.SetPosition(*(-5.0 * view.axes[2]))
        camera.SetViewUp(*view.axes[1])
        camera.SetClippingRange(1.0, 10.0)
        self._renderer = renderer
        self._labels = [
            (add_text(plotter.renderer, name, (0, 0), size[1] * letter, colour, "center center", bold=True), len(name))
            for name, colour in zip(names, colours, strict=True)
        ]

    def show(self, C_VR: Array, directions: Array) -> None:
        """Turn to the attitude of the reference frame (3, 3) and to directions (n, 3) [1], in the camera's frame."""
        self._actor.SetUserMatrix(pose_matrix(np.zeros(3), C_VR))
        for arrow, direction in zip(self._arrows, directions, strict=True):
            side = np.linalg.svd(direction[None])[2][1]
            arrow.SetUserMatrix(pose_matrix(np.zeros(3), np.stack([direction, side, np.cross(direction, side)], 1)))
        tips = np.concatenate([C_VR.T, directions]) @ self._axes[:2].T
        used: list[Array] = []
        for (actor, letters), (x, y) in zip(self._labels, tips, strict=True):
            offset = 0.02 + 0.3 * LETTER * letters * abs(x)  # half the word's width lies beyond the tip
            length = np.hypot(x, y)
            if length < END_ON:
                right, up = -offset, -offset
            else:
                right, up = (CORNER_ARM * c + offset * c / length for c in (x, y))
            while any(np.hypot(right - x0, up - y0) < LETTER for x0, y0 in used):
                up += LETTER  # above the word of an arrow of the same direction
            used.append(np.array([right, up]))
            actor.SetPosition((CORNER[0] + right) / self._aspect, CORNER[1] + up)


def arrows_actor(colours: Sequence[str], lengths: Array, thickness: float) -> Any:
    """Arrows along x, y and z of those lengths (n,) [m], n up to 3; the radius of their tips is `thickness` [m]."""
    import pyvista as pv
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

    arrows = []
    for direction, colour, length in zip(np.eye(3)[: len(lengths)], colours, lengths, strict=True):
        tip = thickness / length
        shape = {"tip_length": 4.0 * tip, "tip_radius": tip, "shaft_radius": 0.42 * tip, "scale": length}
        arrow = pv.Arrow(direction=direction, **shape)
        arrow.cell_data["colour"] = np.tile(np.array(pv.Color(colour).int_rgb, np.uint8), (arrow.n_cells, 1))
        arrows.append(arrow)
    triad = pv.merge(arrows)
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(triad)
    mapper.SetScalarModeToUseCellFieldData()
    mapper.SelectColorArray("colour")
    mapper.SetColorModeToDirectScalars()
    actor.SetMapper(mapper)
    actor.GetProperty().SetAmbient(0.35)
    actor.GetProperty().SetDiffuse(0.7)
    return actor


def pose_matrix(position: Array, attitude: Array) -> Any:
    """The 4 x 4 matrix of a pose, position (3,) [m], for VTK."""
    from vtkmodules.vtkCommonMath import vtkMatrix4x4

    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = attitude, position
    out = vtkMatrix4x4()
    out.DeepCopy(pose.ravel().tolist())
    return out
