"""Appearance of a picture: everything about it that is not the run."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypedDict

from femflex.view.theme import Theme, theme_of

EDGES = ("auto", "sharp", "mesh", "none")
FITS = ("run", "picture")


class LookOptions(TypedDict, total=False):
    """Keywords of `Look`, for functions that take them one by one."""

    theme: str
    size: tuple[int, int]
    scale: float | str
    colour: str
    camera: str
    view: tuple[float, float, float] | None
    triads: bool
    names: bool
    edges: str
    traces: tuple[str, ...]
    fit: str
    title: str | None
    samples: int


@dataclass(frozen=True)
class Look:
    """Appearance of a picture.

    theme    "light" or "dark"
    size     width and height [pixels]
    scale    magnification of the elastic displacement, 1 is true; "auto" makes a small one visible. The picture states
             it. (Bodies have their true poses, so a body on a magnified one seems detached; the undeformed bodies are
             drawn transparent.)
    colour   quantity that colours flexible bodies: "displacement", "energy" or "strain:<name>" (names: see
             `view.paint`); or all bodies: "light" (see `view.sunlight`)
    camera   "auto", "fixed", "follow", "orbital", "body" or "body:<name>"
    view     direction from the scene to the camera, in the camera's frame; None: largest area of the craft
    triads   axes of the bodies, and of the orbital or inertial frame in the corner
    names    names of the bodies, where there are at least two and at most MOST_NAMES
    edges    "sharp", "mesh" (every edge of the elements), "none"; "auto" adds faint mesh lines where they are apart
    traces   markers, "<body>.<marker>", whose path is drawn
    fit      "run": the camera is framed over the whole run; "picture": over the one drawn
    title    None takes the run's
    samples  each pixel is the mean of samples x samples; 0 means 2 for pictures and 1 for movies
    """

    theme: str = "light"
    size: tuple[int, int] = (1280, 720)
    scale: float | str = "auto"
    colour: str = "displacement"
    camera: str = "auto"
    view: tuple[float, float, float] | None = None
    triads: bool = True
    names: bool = True
    edges: str = "auto"
    traces: tuple[str, ...] = ()
    fit: str = "run"
    title: str | None = None
    samples: int = 0

    def __post_init__(self) -> None:
        theme_of(self.theme)
        if self.edges not in EDGES:
            raise ValueError(f"edges {self.edges!r} are not known; known are {list(EDGES)}")
        width, height = self.size
        if not (64 <= width <= 16384 and 64 <= height <= 16384):
            raise ValueError(f"size {width} x {height} is not between 64 and 16384 pixels each way")
        if self.fit not in FITS:
            raise ValueError(f"fit {self.fit!r} is not known; known are {list(FITS)}")
        if self.scale != "auto" if isinstance(self.scale, str) else not self.scale > 0:
            raise ValueError(f"scale {self.scale!r} of the deformation is neither a positive number nor 'auto'")
        if self.view is not None and not all(math.isfinite(component) for component in self.view):
            raise ValueError(f"the view direction {tuple(self.view)} is not finite; give three numbers, as 1,-2,0.5")
        if self.view is not None and not any(self.view):
            raise ValueError("the view direction (0, 0, 0) has no direction; give one from the scene to the camera")

    @property
    def colours(self) -> Theme:
        """The theme."""
        return theme_of(self.theme)
