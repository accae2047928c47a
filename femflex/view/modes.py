"""Pictures of shapes of a body or a craft: a montage of many, a looping movie of one, over the undeformed outline."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.body import FlexibleBody, Skin
from femflex.body.slices import shape_names
from femflex.view.actors import BodyActor, add_ghost
from femflex.view.framing import Margins, View, best_direction, fit_camera
from femflex.view.movie import Progress, write_movie, write_png
from femflex.view.overlay import CornerTriad, add_text
from femflex.view.paint import EVERY, BodyPaint, quantity_of_colour
from femflex.view.surface import MESH_LINE_GAP, VISIBLE, breadth, surface_of, twist_of
from femflex.view.theme import Theme, theme_of
from femflex.view.units import Bar
from femflex.view.window import Drawing, Image, Window, open_window, screenshot_of
from femflex.writing import atomic_file

AMPLITUDE = 0.14  # largest displacement drawn, parts of the body's size
TWISTED = 0.5  # rad; largest twist of slender parts, which widens them by 12 %
MOST = 12  # shapes of a montage when none are named
SAMPLES = 2
TRIAD_LETTER = 0.036  # height of the names of axes, parts of a tile's
Z = np.array([0.0, 0.0, 1.0])


class ShapePaint:
    """A paint whose values reach 1 (or -1) where the chosen shape has its largest, at full amplitude."""

    def __init__(self, paint: BodyPaint) -> None:
        self._paint, self._largest = paint, 1.0
        self.signed = paint.quantity.number is not None

    def choose(self, y: Array) -> None:
        """Select a shape, with its full amplitudes y (n,) [kg^1/2 m]."""
        if self._paint.quantity.kind == EVERY:
            densities: dict[str, float] = {}
            for field_part, _ in self._paint.parts:
                densities[field_part.kind] = max(
                    densities.get(field_part.kind, 0.0), float(np.abs(field_part.energy(y[None])).max())
                )
            largest = {kind: density or 1.0 for kind, density in densities.items()}
            self._paint = replace(self._paint, quantity=replace(self._paint.quantity, largest=largest))
        self._largest = float(np.nanmax(np.abs(self._paint.values(y)), initial=0.0)) or 1.0

    def values(self, y: Array) -> NDArray[np.float32]:
        """Values (n_skin,) [1] at the points of the skin, parts of the largest."""
        return self._paint.values(y) / np.float32(self._largest)


def shape_paint(body: FlexibleBody, skin: Skin, colour: str) -> ShapePaint | None:
    """The paint of a body's shapes; None for "displacement". Raises ValueError as `view.paint.quantity_of_colour`."""
    if colour == "displacement":
        return None
    linear = tuple(
        replace(field_part, nonlinear=False, stress=0 * field_part.stress) for field_part in body.strain_field
    )
    return ShapePaint(BodyPaint.from_field(quantity_of_colour(colour, list(linear), "the body"), linear, skin))


class ShapeOptions(TypedDict, total=False):
    """Keywords of pictures and movies of shapes.

    size  of the picture of a shape [pixels];  view  direction from the body to the camera;  force  replaces a file
    """

    theme: str
    size: tuple[int, int]
    view: tuple[float, float, float] | None
    force: bool


class MovieOptions(ShapeOptions, total=False):
    """Further keywords of movies: seconds of a cycle, number of cycles, frames a second, and a call after each."""

    seconds: float
    cycles: int
    fps: float
    progress: Progress | None


def mode_montage(
    body: FlexibleBody,
    path: str | Path,
    modes: Sequence[int] | None = None,
    title: str = "",
    colour: str = "displacement",
    **options: Unpack[ShapeOptions],
) -> Path:
    """Path of a PNG picture of shapes, numbered from 1 (by default the first twelve), each with its frequency.

    Every shape is drawn with the same largest displacement, and coloured by it, or by its strain or energy density up
    to the shape's own largest (`colour`, as of `Look`; to lowest order in the amplitude). Raises ValueError for a body
    without skin or shapes.
    """
    skin = _checked_skin(body)
    numbers = list(range(1, min(body.n_modes, MOST) + 1)) if modes is None else list(modes)
    if not numbers:
        raise ValueError("the list of modes to draw is empty; name some, or give no list for the first ones")
    shapes = [(_shape_index(body, mode), caption(body, mode)) for mode in numbers]
    return _montage(skin, shapes, path, title, shape_paint(body, skin, colour), **options)


def craft_montage(
    skin: Skin, captions: Sequence[str], path: str | Path, title: str = "", **options: Unpack[ShapeOptions]
) -> Path:
    """Path of a PNG picture of modes of a craft, each with its caption, in their largest deflection.

    skin: of the craft, with the real and then the imaginary parts of as many shapes as captions. As `mode_montage`.
    """
    return _montage(skin, list(enumerate(captions)), path, title, None, **options)


def mode_movie(
    body: FlexibleBody, path: str | Path, mode: int = 1, colour: str = "displacement", **options: Unpack[MovieOptions]
) -> Path:
    """Path of a movie of one shape, numbered from 1, that swings whole cycles and loops smoothly.

    colour: as for `mode_montage`.
    """
    skin, number = _checked_skin(body), _shape_index(body, mode)
    return _movie(skin, path, (number, caption(body, mode), None), shape_paint(body, skin, colour), **options)


def craft_movie(skin: Skin, caption: str, path: str | Path, **options: Unpack[MovieOptions]) -> Path:
    """Path of a movie of one mode of a craft, whose parts may move out of phase; loops smoothly.

    skin: of the craft, with two shapes, the real and the imaginary part.
    """
    return _movie(skin, path, (0, caption, 1), None, **options)


def _montage(
    skin: Skin,
    shapes: Sequence[tuple[int, str]],
    path: str | Path,
    title: str,
    paint: ShapePaint | None,
    *,
    theme: str = "light",
    size: tuple[int, int] = (420, 300),
    view: tuple[float, float, float] | None = None,
    force: bool = False,
) -> Path:
    """The picture of shapes of a skin, counted from 0, each with its caption."""
    path = Path(path)
    if path.suffix.lower() != ".png":
        raise ValueError(f"a picture is written as .png; {path.name} is not one")
    with atomic_file(path, force) as draft, _ModeScene(skin, theme_of(theme), size, view, SAMPLES, paint) as scene:
        tiles = []
        for number, text in shapes:
            scene.choose(number, text)
            scene.show(1.0)
            tiles.append(scene.image())
        write_png(draft, _tile_sheet(tiles, title, theme_of(theme)))
    return Drawing(path)


def _movie(
    skin: Skin,
    path: str | Path,
    shape: tuple[int, str, int | None],
    paint: ShapePaint | None,
    *,
    theme: str = "light",
    size: tuple[int, int] = (960, 640),
    view: tuple[float, float, float] | None = None,
    force: bool = False,
    seconds: float = 2.0,
    cycles: int = 3,
    fps: float = 25.0,
    progress: Progress | None = None,
) -> Path:
    """The movie of a shape of a skin, by its number, its caption and the shape a quarter of a cycle later, if any."""
    if cycles < 1 or not seconds > 0:
        raise ValueError(f"a movie of {cycles} cycles of {seconds:g} s has no length; give at least one, above 0 s")
    count = max(2, round(seconds * fps))
    with _ModeScene(skin, theme_of(theme), size, view, 1, paint) as scene:
        scene.choose(*shape)
        return write_movie(path, _swing(scene, count, cycles), count * cycles, fps, force, progress)


def caption(body: FlexibleBody, mode: int) -> str:
    """Text under a shape: number, name and frequency, or its kind where it has no frequency.

    The number counts from 1.
    """
    name = shape_names(body)[mode - 1]
    omega = body.omega[mode - 1] if len(body.omega) >= mode else np.nan
    kind = body.kinds[mode - 1] if len(body.kinds) >= mode else "shape"
    if np.isfinite(omega):
        return " · ".join(filter(None, (str(mode), name, _hertz(omega / (2 * np.pi)))))
    return f"shape {mode} · {kind}"


def _hertz(frequency: float) -> str:
    if frequency and abs(frequency) < 0.1:
        return f"{frequency * 1e3:#.4g} mHz"
    return f"{frequency / 1e3:#.4g} kHz" if frequency >= 1e4 else f"{frequency:#.4g} Hz"


class _ModeScene(Window):
    """A window with one body or craft, deformed by one shape at a time over its undeformed outline."""

    def __init__(
        self, skin: Skin, theme: Theme, size: tuple[int, int], view: Any, samples: int, paint: ShapePaint | None
    ) -> None:
        self._skin, self._unit, self._twist = skin, np.zeros(len(skin.shapes)), twist_of(skin)
        self._quadrature, self._extent = self._unit, float(np.linalg.norm(np.ptp(skin.points, axis=0))) or 1.0
        camera = self._camera(view, size[0] / size[1])
        super().__init__(size, theme, camera, samples)
        width, height = self._size
        slender = breadth(skin) * camera.pixels(size[1]) < VISIBLE
        surface = surface_of(skin, "thick" if slender else "auto", MESH_LINE_GAP / camera.pixels(size[1]))
        pixel = height / 720 + 0.35 * samples
        self._paint = paint
        bar = Bar(1.0, "", AMPLITUDE * self._extent, 4)
        if self._paint is not None:
            bar = Bar(1.0, "", 1.0, 4, self._paint.signed)
        self._body = BodyActor(self._plotter, surface, theme.rigid[0], theme, bar, pixel, self._paint)
        add_ghost(self._plotter, surface, theme, pixel)
        triad = CornerTriad(self._plotter, camera, ("x", "y", "z"), theme, (width, height), TRIAD_LETTER)
        triad.show(np.eye(3), np.zeros((0, 3)))
        self._caption = add_text(
            self._plotter.renderer, "", (0.5, 0.045), 0.03 * height + 9 * samples, theme.text, "center bottom"
        )

    def choose(self, number: int, text: str, quadrature: int | None = None) -> None:
        """Select shape `number`, from 0, and a shape that moves a quarter of a cycle later, if any."""
        largest = self._skin.max_displacement[number]
        self._unit = np.zeros(len(self._skin.shapes))
        if largest:
            self._unit[number] = min(AMPLITUDE * self._extent / largest, TWISTED / max(self._twist[number], 1e-300))
            self._body.rescale(self._unit[number] * largest)
        self._quadrature = np.zeros(len(self._skin.shapes))
        if quadrature is not None:
            self._quadrature[quadrature] = self._unit[number]
        if self._paint is not None:
            self._paint.choose(self._unit)
        self._caption.SetInput(text)

    def show(self, amplitude: float, quadrature: float = 0.0) -> None:
        """Deform by the chosen shape, with amplitude in [-1, 1], and by that in quadrature."""
        self._body.show(np.zeros(3), np.eye(3), amplitude * self._unit + quadrature * self._quadrature, 1.0)

    def _camera(self, view: Any, aspect: float) -> View:
        """A camera that has every shape in the picture, at both ends of its swing."""
        towards = best_direction(self._skin.points, Z) if view is None else np.asarray(view, float)
        reach = [self._skin.points]
        for shape, largest in zip(self._skin.shapes, self._skin.max_displacement, strict=True):
            swing = AMPLITUDE * self._extent / (largest or 1.0) * shape
            reach += [self._skin.points + swing, self._skin.points - swing]
        return fit_camera(np.concatenate(reach), towards, Z, aspect, Margins(0.05, 0.05, 0.06, 0.16))


def _swing(scene: _ModeScene, count: int, cycles: int) -> Iterator[Image]:
    for k in range(count * cycles):
        angle = 2 * math.pi * k / count
        scene.show(math.sin(angle), math.cos(angle))
        yield scene.image()


def _tile_sheet(tiles: list[Image], title: str, theme: Theme) -> Image:
    """Tiles in rows, as wide as high, with a title above."""
    columns = min(len(tiles), math.ceil(math.sqrt(len(tiles))))
    blank = np.broadcast_to(tiles[0][:1, :1], tiles[0].shape)
    filled = tiles + [blank] * (-len(tiles) % columns)
    rows = [np.concatenate(filled[k : k + columns], axis=1) for k in range(0, len(filled), columns)]
    if title:
        rows.insert(0, _title_band(title, rows[0].shape[1], max(36, tiles[0].shape[0] // 7), theme))
    return np.concatenate(rows)


def _title_band(title: str, width: int, height: int, theme: Theme) -> Image:
    plotter = open_window((width, height), theme)
    add_text(plotter.renderer, title, (0.5, 0.45), 0.5 * height, theme.text, "center center", bold=True)
    image = screenshot_of(plotter)
    plotter.close()
    return image


def _checked_skin(body: FlexibleBody) -> Skin:
    if body.n_modes == 0:
        raise ValueError("the body is rigid: it has no shapes to draw")
    if body.skin is None:
        raise ValueError("the body has no skin, so its shapes cannot be drawn")
    return body.skin


def _shape_index(body: FlexibleBody, mode: int) -> int:
    if not 1 <= mode <= body.n_modes:
        raise ValueError(f"mode {mode} is not on the body; its modes are 1 to {body.n_modes}")
    return mode - 1
