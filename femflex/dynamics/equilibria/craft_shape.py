"""The whole craft as one drawing: skins of all bodies in an equilibrium, moved by each of its small motions."""

from __future__ import annotations

import numpy as np

from femflex.arrays import ComplexArray, IntArray
from femflex.body import FlexibleBody, Skin
from femflex.dynamics.equilibria.body_motions import BodyMotion
from femflex.system import System

DOT = {"vertex": np.zeros((1, 1), np.int64)}  # of a body that has no skin


def craft_skin(system: System, bodies: dict[str, BodyMotion], motions: ComplexArray) -> Skin:
    """The skin of the craft in the base frame, with 2 k shapes for motions (n_u, k): their real, then imaginary parts.

    Every motion is turned in phase so that its real part is as large as can be. Bodies without a skin are drawn as a
    point at their centre of mass.
    """
    points, shapes, count = [], [], 0
    cells: dict[str, list[IntArray]] = {}
    for name in system.order:
        skin = system.bodies[name].skin or _dot(system.bodies[name])
        motion = bodies[name]
        arms = (skin.points + np.einsum("spa,s->pa", skin.shapes, motion.delta)) @ motion.attitude.T
        slide, turn, rates = motion.along(motions)
        own = np.einsum("spa,sk->kpa", skin.shapes, rates, optimize=True)
        shapes.append(slide.T[:, None] + np.cross(turn.T[:, None], arms) + own @ motion.attitude.T)
        points.append(motion.position + arms)
        for kind, numbers in skin.cells.items():
            cells.setdefault(kind, []).append(numbers + count)
        count += len(skin.points)
    moved = np.concatenate(shapes, axis=1)
    square = np.sum(moved**2, axis=(1, 2))
    moved = moved * np.exp(-0.5j * np.angle(square))[:, None, None]
    return Skin(
        np.concatenate(points),
        {kind: np.concatenate(numbers) for kind, numbers in cells.items()},
        np.concatenate([moved.real, moved.imag]),
    )


def _dot(body: FlexibleBody) -> Skin:
    centre, first = body.moments.center_of_mass(), body.moments.first[1:]
    return Skin(centre[None], DOT, (first / body.moments.mass)[:, None, :])
