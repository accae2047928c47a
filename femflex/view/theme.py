"""Colours of pictures and plots, light and dark."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.colors import ListedColormap


LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of red, green and blue
LIGHTER = (0.25, 0.45)  # share of white in lighter mesh lines: on black, and what luminance adds
SUNLIGHT = ("#2b3550", "#6d6a72", "#b5925c", "#f0c34f", "#fff1c0")  # from shadow to full sunlight
DARKER = 0.55  # brightness of darker mesh lines


@dataclass(frozen=True)
class Theme:
    """Colours by use.

    elastic  colour map of the elastic displacement, and the position of zero on it (its darkest part is hard to see)
    signed   colour map of quantities that may be negative
    lines    colours of curves, in turn
    """

    background: str  # of stills, movies, montages and plots
    text: str
    faint: str  # second lines, grids
    rigid: tuple[str, ...]  # bodies without elastic displacement, in turn
    edge: str
    trace: str
    ghost: str  # undeformed outline
    axes: tuple[str, str, str]
    directions: dict[str, str]  # of arrows to the sun and along fields, by their words
    elastic: tuple[str, float]
    signed: str
    lines: tuple[str, ...]

    def colour_map(self, signed: bool = False) -> ListedColormap:
        """The colours from none to the largest, or from the least to the largest if values may be negative."""
        import matplotlib
        from matplotlib.colors import ListedColormap

        name, zero = (self.signed, 0.0) if signed else self.elastic
        return ListedColormap(matplotlib.colormaps[name](np.linspace(zero, 1.0, 256)))

    def light_map(self) -> ListedColormap:
        """The colours from shadow to full sunlight, alike in both themes."""
        from matplotlib.colors import LinearSegmentedColormap, ListedColormap

        return ListedColormap(LinearSegmentedColormap.from_list("sunlight", SUNLIGHT)(np.linspace(0.0, 1.0, 256)))

    def mesh_line_map(self, signed: bool = False) -> ListedColormap:
        """The colours of mesh lines on faces of `colour_map`: lighter, or darker where zero is light.

        They change continuously with the colours of faces: a step would look like one of the quantity.
        """
        from matplotlib.colors import ListedColormap

        faces = np.asarray(self.colour_map(signed).colors)[:, :3]
        white = LIGHTER[0] + LIGHTER[1] * (faces @ LUMINANCE)[:, None]
        return ListedColormap(DARKER * faces if signed else faces + white * (1.0 - faces))


THEMES = {
    "light": Theme(
        background="#ffffff",
        text="#1c2733",
        faint="#6a7886",
        rigid=("#b9bfc6", "#a5aeb8", "#cdc8bd"),
        edge="#27313b",
        trace="#d1495b",
        ghost="#8a97a4",
        axes=("#d62f3c", "#2c9c4b", "#2b62d9"),
        directions={"sun": "#c99700", "field": "#8b4fa3"},
        elastic=("viridis", 0.26),
        signed="coolwarm",
        lines=("#1f5fa8", "#d9622b", "#2f8f5b", "#8b4fa3", "#b8860b", "#118a9c", "#c2386b", "#5c6670"),
    ),
    "dark": Theme(
        background="#10151c",
        text="#eef2f6",
        faint="#97a5b4",
        rigid=("#98a1ab", "#828d99", "#b0ab9f"),
        edge="#06090d",
        trace="#ff8a70",
        ghost="#7d8b9a",
        axes=("#ff5a5f", "#4fd06f", "#6a9bff"),
        directions={"sun": "#ffd23f", "field": "#cf9be6"},
        elastic=("plasma", 0.22),
        signed="coolwarm",
        lines=("#6aaef5", "#ff9d5c", "#67d391", "#cf9be6", "#e8c35a", "#56cfe0", "#f57fa6", "#b4bec8"),
    ),
}


def theme_of(name: str) -> Theme:
    """The theme of that name.

    >>> theme_of("dark").background
    '#10151c'
    """
    if name not in THEMES:
        raise ValueError(f"theme {name!r} is not known; known are {sorted(THEMES)}")
    return THEMES[name]
