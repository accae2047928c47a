"""Camera position from which everything is in the picture, with space for the texts around it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array

VIEW_ANGLE = np.deg2rad(24.0)  # vertical; long lenses distort less
ELEVATIONS = np.deg2rad([24.0])
AZIMUTHS = np.deg2rad([-60.0, -30.0, 30.0, 60.0, 120.0, 150.0, 210.0, 240.0])
HIDDEN = 0.25  # share of its area that counts from where a displacement is not seen
FIRST_BONUS = 1.1  # another direction must have a larger area by this factor


@dataclass(frozen=True)
class Margins:
    """Fractions of the width and height that are kept free at the borders."""

    left: float = 0.04
    right: float = 0.04
    top: float = 0.12
    bottom: float = 0.12


@dataclass(frozen=True, eq=False)
class View:
    """A camera: position and focus (3,) [m], upward direction (3,), vertical view angle [rad], clipping range [m]."""

    position: Array
    focus: Array
    up: Array
    angle: float
    near: float
    far: float

    def pixels(self, height: int) -> float:
        """Pixels of a metre in the middle of a picture of that height."""
        return float(height / (2 * np.tan(self.angle / 2) * np.linalg.norm(self.focus - self.position)))

    @property
    def axes(self) -> Array:
        """Rows (3, 3), unit vectors: to the right, upward, and towards the scene."""
        return screen_axes(self.position - self.focus, self.up)

    def on_screen(self, points: Array, aspect: float) -> Array:
        """Positions (n, 2) of points (n, 3) [m] on the screen, from the lower left, as fractions of the size."""
        x, y, z = self.axes @ (points - self.position).T
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


def fit_camera(cloud: Array, towards: Array, up: Array, aspect: float, margins: Margins) -> View:
    """The nearest camera in direction `towards` with every point (n, 3) [m] of a cloud between the margins.

    With screen coordinates x, y, depth z and tangents t of the half angles at a rim, every point requires
    x - c_x <= t (z - c_z), and likewise at the other sides; the extreme points of each side give the camera c exactly.
    """
    axes = screen_axes(towards, up)
    x, y, z = axes @ cloud.T
    tan_y = np.tan(VIEW_ANGLE / 2)
    tan_x = tan_y * aspect
    right, left_tangent = tan_x * (1 - 2 * margins.right), tan_x * (1 - 2 * margins.left)
    above, below = tan_y * (1 - 2 * margins.top), tan_y * (1 - 2 * margins.bottom)
    ends = [
        ((x - right * z).max(), (-x - left_tangent * z).max(), right, left_tangent),
        ((y - above * z).max(), (-y - below * z).max(), above, below),
    ]
    c_z = min(-(a + b) / (t + s) for a, b, t, s in ends)
    size = float(np.linalg.norm(np.ptp(cloud, axis=0))) or 1.0
    c_z = min(c_z, z.min() - 0.05 * size)
    c_x, c_y = (((a + t * c_z) - (b + s * c_z)) / 2 for a, b, t, s in ends)
    position = axes.T @ np.array([c_x, c_y, c_z])
    nearest, farthest = z.min() - c_z, z.max() - c_z
    focus = position + axes[2] * (nearest + farthest) / 2
    return View(
        position, focus, axes[1], float(VIEW_ANGLE), max(nearest - 0.2 * size, 0.02 * nearest), farthest + 0.2 * size
    )


def fit_camera_clear_of_corner(
    cloud: Array, towards: Array, up: Array, aspect: float, margins: Margins, corner: tuple[float, float]
) -> View:
    """The nearest camera as by `fit_camera` without any point (n, 3) [m] of a cloud in the lower left corner.

    corner: its width and height, as fractions of the picture's height. It is cleared by a wider left or bottom margin.
    """
    camera = fit_camera(cloud, towards, up, aspect, margins)
    width, height = corner[0] / aspect, corner[1]
    screen_points = camera.on_screen(cloud, aspect)
    if not ((screen_points[:, 0] < width) & (screen_points[:, 1] < height)).any():
        return camera
    margin_options = replace(margins, left=width), replace(margins, bottom=height)
    views = [fit_camera(cloud, towards, up, aspect, margin) for margin in margin_options]
    return max(views, key=lambda candidate: candidate.pixels(1))


def best_direction(cloud: Array, up: Array, shift: Array | None = None) -> Array:
    """The direction (3,) from which a cloud (n, 3) [m] has the largest area on the screen.

    shift: (3,) [m] a displacement that should be seen: along the line of sight it reduces the area to HIDDEN of it
    """
    length = 0.0 if shift is None else float(np.linalg.norm(shift))
    horizontal = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    horizontal = horizontal - up * (up @ horizontal)
    horizontal /= np.linalg.norm(horizontal)
    second_horizontal = np.cross(up, horizontal)
    best, largest_area = horizontal, -1.0
    for k, (elevation, azimuth) in enumerate((e, a) for e in ELEVATIONS for a in AZIMUTHS):
        level = np.cos(azimuth) * horizontal + np.sin(azimuth) * second_horizontal
        towards = np.cos(elevation) * level + np.sin(elevation) * up
        screen = screen_axes(towards, up)[:2]
        flat = cloud @ screen.T
        area = np.sqrt(max(np.linalg.det(np.cov(flat.T)), 0.0)) * (FIRST_BONUS if k == 0 else 1.0)
        if shift is not None and length > 0:
            area *= HIDDEN + (1 - HIDDEN) * np.linalg.norm(screen @ shift) / length
        if area > largest_area * (1 + 1e-9):
            best, largest_area = towards, area
    return best
