"""Off-screen window without output of the renderer, or an error if there is none; drawn files."""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from femflex.extras import require
from femflex.view.framing import View
from femflex.view.theme import Theme

LARGEST = 40_000_000  # bytes of a movie or page that a notebook takes in
LIGHTS = (((0.3, 0.0, 1.0), 0.75), ((-0.7, 0.8, 0.7), 0.55))  # next to the camera, at z = 1: direction and intensity


class Drawing(type(Path())):  # type: ignore[misc]  # Path itself cannot be subclassed before Python 3.12
    """Path of a picture, movie or page. A notebook shows PNG, SVG, MP4 and HTML files; elsewhere it is a path."""

    __slots__ = ()

    def _repr_png_(self) -> bytes | None:
        return self.read_bytes() if self.suffix.lower() == ".png" and self.is_file() else None

    def _repr_svg_(self) -> str | None:
        return self.read_text(encoding="utf-8") if self.suffix.lower() == ".svg" and self.is_file() else None

    def _repr_html_(self) -> str | None:
        if not self.is_file() or self.stat().st_size > LARGEST:
            return None
        if self.suffix.lower() in (".html", ".htm"):
            text = escape(self.read_text(encoding="utf-8"))
            return f'<iframe srcdoc="{text}" width="100%" height="700" style="border:0"></iframe>'
        if self.suffix.lower() != ".mp4":
            return None
        data = base64.b64encode(self.read_bytes()).decode("ascii")
        return f'<video controls loop width="100%" src="data:video/mp4;base64,{data}"></video>'


Image = NDArray[np.uint8]


class NoRenderer(RuntimeError):
    """No off-screen renderer starts on this machine; results are not affected."""


def open_window(size: tuple[int, int], theme: Theme) -> Any:
    """A pyvista plotter of that size (pixels) off screen, one sample a pixel, with the theme's background.

    Raises MissingExtra, and NoRenderer when neither a display nor EGL nor OSMesa is available.
    """
    require("view", "pictures")
    import pyvista as pv
    from vtkmodules.vtkCommonCore import vtkObject

    display_warnings = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()  # it would report a missing display even if another renderer is found
    try:
        plotter: Any = pv.Plotter(off_screen=True, window_size=list(size), lighting="none")
        window = plotter.render_window
        window.SetMultiSamples(1)
        window.Initialize()
        started = window.GetInitialized()
    finally:
        vtkObject.SetGlobalWarningDisplay(display_warnings)
    if not started:
        plotter.close()
        raise NoRenderer(
            "no picture can be drawn: no off-screen renderer starts here; install EGL or OSMesa "
            "(on Debian and Ubuntu: libegl1 or libosmesa6), or draw the pictures from the result file elsewhere"
        )
    plotter.set_background(theme.background)
    for direction, intensity in LIGHTS:
        plotter.add_light(
            pv.Light(position=direction, focal_point=(0, 0, 0), intensity=intensity, light_type="camera light")
        )
    return plotter


def screenshot_of(plotter: Any, samples: int = 1) -> Image:
    """The picture of a plotter's window, (height, width, 3), each pixel the mean of samples x samples drawn ones."""
    plotter.render_window.Render()
    image: Image = plotter.screenshot(None, return_img=True)[..., :3]
    if samples == 1:
        return image
    height, width = image.shape[0] // samples, image.shape[1] // samples
    blocks = image[: height * samples, : width * samples].reshape(height, samples, width, samples, 3)
    return np.asarray(np.round(blocks.mean(axis=(1, 3), dtype=np.float32)), np.uint8)


def place_camera(plotter: Any, view: View) -> None:
    """Set the camera of a plotter."""
    plotter.camera.position = tuple(view.position)
    plotter.camera.focal_point = tuple(view.focus)
    plotter.camera.up = tuple(view.up)
    plotter.camera.view_angle = float(np.rad2deg(view.angle))
    plotter.camera.clipping_range = (view.near, view.far)
    plotter.camera_set = True


class Window:
    """A window off screen with a camera; use it in a `with` statement.

    samples: each pixel of an image is the mean of samples x samples drawn ones
    """

    def __init__(self, size: tuple[int, int], theme: Theme, view: View, samples: int) -> None:
        """size: of an image [pixels]. Raises as `open_window`."""
        self._size, self._samples = (size[0] * samples, size[1] * samples), samples
        self._plotter = open_window(self._size, theme)
        place_camera(self._plotter, view)

    def image(self) -> Image:
        """The picture, (height, width, 3)."""
        return screenshot_of(self._plotter, self._samples)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._plotter.close()
