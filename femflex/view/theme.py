"""Colours of pictures and plots, light and dark."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femflex.arrays import Array
from femflex.extras import require

if TYPE_CHECKING:
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of red, green and blue
LIGHTER = (0.25, 0.45)  # share of white in lighter mesh lines: on black, and what luminance adds
SUNLIGHT = ("#2b3550", "#6d6a72", "#b5925c", "#f0c34f", "#fff1c0")  # from shadow to full sunlight
DARKER = 0.55  # brightness of darker mesh lines
# the maps of matplotlib without their darkest part, on which edges are hard to see
VIRIDIS = (
    "#3a548c #34618d #2e6d8e #2a788e #26828e #218e8d #1f998a #20a486 #29af7f "
    "#3aba76 #4ec36b #67cc5c #84d44b #a2da37 #c2df23 #e2e418 #fde725"
)
PLASMA = (
    "#7201a8 #8405a7 #9613a1 #a62098 #b52f8c #c23c81 #ce4b75 #d9586a #e3685f "
    "#eb7655 #f3874a #f9973f #fca934 #febb2b #fcd025 #f7e425 #f0f921"
)


@dataclass(frozen=True)
class Theme:
    """Colours by use.

    elastic  colours of the elastic displacement, from none to the largest
    signed   colour map of matplotlib for quantities that may be negative
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
    elastic: str
    signed: str
    lines: tuple[str, ...]

    def colour_map(self, signed: bool = False) -> ListedColormap:
        """The colours from none to the largest, or from the least to the largest if values may be negative."""
        require("view", "pictures")
        import matplotlib
        from matplotlib.colors import ListedColormap

        return ListedColormap(
            matplotlib.colormaps[self.signed](np.linspace(0.0, 1.0, 256)) if signed else self.elastic_colours(256)
        )

    def elastic_colours(self, n: int) -> Array:
        """Red, green and blue (n, 3) from 0 to 1, from no elastic displacement to the largest.

        >>> theme_of("light").elastic_colours(2).round(1).tolist()
        [[0.2, 0.3, 0.5], [1.0, 0.9, 0.1]]
        """
        known = np.array([list(bytes.fromhex(colour[1:])) for colour in self.elastic.split()]) / 255.0
        places = np.linspace(0.0, len(known) - 1.0, n)
        return np.stack([np.interp(places, np.arange(len(known)), part) for part in known.T], axis=1)

    def figure(self, width: float, height: float, title: str) -> Figure:
        """An empty figure of matplotlib with its title; width, height [inch]. Raises MissingExtra."""
        require("view", "plots")
        from matplotlib.figure import Figure

        figure = Figure(figsize=(width, height), layout="constrained", facecolor=self.background)
        figure.suptitle(title, color=self.text, fontsize=12, fontweight="bold")
        return figure

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
        elastic=VIRIDIS,
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
        elastic=PLASMA,
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
