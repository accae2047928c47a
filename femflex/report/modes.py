"""The report of the modes of a craft: a table, and every shape as a vibration that one can turn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femflex.report.page import Page
from femflex.report.run import modes_table
from femflex.report.scene import Clip, ShownBody, packed
from femflex.view.surface import surface_of
from femflex.writing import atomic_file

if TYPE_CHECKING:
    from femflex.dynamics.linear.system_modes import SystemModes

MOST = 30  # shapes, so that a page stays small
PHASES = 25  # instants of a period
SWING = 0.08  # of the craft's size: the largest displacement at a magnification of 1


def write_modes_report(modes: SystemModes, title: str, path: str | Path, force: bool = False) -> None:
    """Write the modes of a craft as one HTML file. Parts may move out of phase, as damping and spin make them.

    Raises ValueError where no body can be drawn, and OSError.
    """
    numbers = [k + 1 for k, rigid in enumerate(modes.known) if not rigid][:MOST]
    if not numbers:
        raise ValueError("the craft has only rigid-body modes, which are not drawn")
    skin = modes.skin(numbers)
    size = float(np.linalg.norm(np.ptp(skin.points, axis=0))) or 1.0
    phase = np.linspace(0.0, 2.0 * np.pi, PHASES)
    n, clips = len(numbers), []
    for i, number in enumerate(numbers):
        weights = np.zeros((PHASES, 2 * n))
        reach = float(np.hypot(skin.max_displacement[i], skin.max_displacement[n + i])) or 1.0
        weights[:, i], weights[:, n + i] = np.cos(phase), -np.sin(phase)
        poses = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (PHASES, 1))
        name = f"{number} {modes.label(number)}, {modes.frequencies[number - 1]:.4g} Hz"
        amplitude = SWING * size / reach
        clips.append(Clip(name, phase, {"craft": poses}, {"craft": amplitude * weights}, 1.0, repeats=True))
    in_orbit = modes.about.model.system.orbit is not None
    page = Page(title, [modes.about.verdict])
    page.add_scene("Shapes", packed([ShownBody("craft", surface_of(skin))], clips, 1 if in_orbit else 2))
    page.add("Modes", modes_table(modes, len(modes.names)))
    with atomic_file(path, force) as part:
        part.write_text(page.html(), encoding="utf-8")
