"""Where the camera stands so that everything fits, with room left for the texts around."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array

VIEW_ANGLE = np.deg2rad(24.0)  # vertical; long lenses distort less
ELEVATIONS = np.deg2rad([24.0])
AZIMUTHS = np.deg2rad([-60.0, -30.0, 30.0, 60.0, 120.0, 150.0, 210.0, 240.0])
FIRST_BONUS = 1.1  # another direction must show more by this factor


@dataclass(frozen=True)
class Margins:
    """Parts of the width and height kept free at the rims."""

    left: float = 0.04
    right: float = 0.04
    top: float = 0.12
    bottom: float = 0.12


@dataclass(frozen=True, eq=False)
class View:
    """A camera: place and focus (3,) [m], upward direction (3,), vertical view angle [rad], clipping range [m]."""

    place: Array
    focus: Array
    up: Array
    angle: float
    near: float
    far: float

    def pixels(self, height: int) -> float:
        """Pixels of a metre in the middle of a picture of that height."""
        return float(height / (2 * np.tan(self.angle / 2) * np.linalg.norm(self.focus - self.place)))

    @property
    def axes(self) -> Array:
        """Rows (3, 3), unit vectors: to the right, upward, and towards the scene."""
        return screen_axes(self.place - self.focus, self.up)

    def on_screen(self, points: Array, aspect: float) -> Array:
        """Where points (n, 3) [m] are seen (n, 2): from the left and the bottom, parts of the width and height."""
        x, y, z = self.axes @ (points - self.place).T
        t = np.tan(self.angle / 2)
        return np.column_stack([0.5 + 0.5 * x / (z * t * aspect), 0.5 + 0.5 * y / (z * t)])


def screen_axes(towards: Array, up: Array) -> Array:
    """Unit vectors, rows (3, 3): right, up and forward on the screen of a camera that stands in direction `towards`."""
    forward = -np.asarray(towards, float) / np.linalg.norm(towards)
    right = np.cross(forward, up)
    if np.linalg.norm(right) < 1e-6:  # looking along the upward direction
        right = np.cross(forward, np.roll(up, 1))
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(right, forward), forward])


def framed(cloud: Array, towards: Array, up: Array, aspect: float, margins: Margins) -> View:
    """The nearest camera in direction `towards` that has every point (n, 3) [m] of a cloud between the margins.

    With screen coordinates x, y, depth z and tangents t of the half angles at a rim, every point asks for
    x - c_x <= t (z - c_z), and likewise at the other rims; the largest of each side places the camera c exactly.
    """
    axes = screen_axes(towards, up)
    x, y, z = axes @ cloud.T
    tan_y = np.tan(VIEW_ANGLE / 2)
    tan_x = tan_y * aspect
    right, left = tan_x * (1 - 2 * margins.right), tan_x * (1 - 2 * margins.left)
    above, below = tan_y * (1 - 2 * margins.top), tan_y * (1 - 2 * margins.bottom)
    ends = [
        ((x - right * z).max(), (-x - left * z).max(), right, left),
        ((y - above * z).max(), (-y - below * z).max(), above, below),
    ]
    c_z = min(-(a + b) / (t + s) for a, b, t, s in ends)
    size = float(np.linalg.norm(np.ptp(cloud, axis=0))) or 1.0
    c_z = min(c_z, z.min() - 0.05 * size)
    c_x, c_y = (((a + t * c_z) - (b + s * c_z)) / 2 for a, b, t, s in ends)
    place = axes.T @ np.array([c_x, c_y, c_z])
    near, far = z.min() - c_z, z.max() - c_z
    focus = place + axes[2] * (near + far) / 2
    return View(place, focus, axes[1], float(VIEW_ANGLE), max(near - 0.2 * size, 0.02 * near), far + 0.2 * size)


def framed_clear_of_corner(
    cloud: Array, towards: Array, up: Array, aspect: float, margins: Margins, corner: tuple[float, float]
) -> View:
    """The nearest camera as by `framed` that shows no point (n, 3) [m] of a cloud in the lower left corner.

    corner: its width and height, parts of the picture's height. It is cleared by a wider left or bottom margin.
    """
    view = framed(cloud, towards, up, aspect, margins)
    width, height = corner[0] / aspect, corner[1]
    seen = view.on_screen(cloud, aspect)
    if not ((seen[:, 0] < width) & (seen[:, 1] < height)).any():
        return view
    clear = replace(margins, left=width), replace(margins, bottom=height)
    views = [framed(cloud, towards, up, aspect, margin) for margin in clear]
    return max(views, key=lambda one: one.pixels(1))


def best_direction(cloud: Array, up: Array) -> Array:
    """The direction (3,) from which a cloud (n, 3) [m] shows most of itself: largest area of its spread on the
    screen."""
    first = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = first - up * (up @ first)
    first /= np.linalg.norm(first)
    second = np.cross(up, first)
    best, most = first, -1.0
    for k, (elevation, azimuth) in enumerate((e, a) for e in ELEVATIONS for a in AZIMUTHS):
        level = np.cos(azimuth) * first + np.sin(azimuth) * second
        towards = np.cos(elevation) * level + np.sin(elevation) * up
        flat = cloud @ screen_axes(towards, up)[:2].T
        shown = np.sqrt(max(np.linalg.det(np.cov(flat.T)), 0.0)) * (FIRST_BONUS if k == 0 else 1.0)
        if shown > most * (1 + 1e-9):
            best, most = towards, shown
    return best
