"""The drawn skin of plates: closed, of the right volume, and moved by the plate's own field."""

from __future__ import annotations

import numpy as np
import pytest
from support.plate_models import CELL, bent_mesh, displaced, plate_structure, random_rotation
from test_plate_fold import bent

from femflex.mesh import rectangle

H = 0.05
SHIFT = np.array([0.1, 0.2, 0.3])


def triangles_of(skin) -> np.ndarray:
    quads = skin.cells["quad"]
    halves = [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
    return np.concatenate([skin.cells.get("triangle", np.zeros((0, 3), int)), *halves])


def flat(family: str, turn: np.ndarray):
    mesh = bent_mesh("triangle", 3) if family == "plate" else rectangle(1.2, 0.9, 3, 2, "quad")
    return plate_structure(mesh.rotated(turn), H, family)


@pytest.mark.parametrize("family", ["plate", "plate_bfs"])
def test_the_skin_of_a_plate_is_closed_and_has_its_volume(family):
    for turn in (np.eye(3), random_rotation(3)):
        skin = flat(family, turn).skin
        faces = triangles_of(skin)
        x = skin.points[faces]
        normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) / 2
        assert np.sum(x.mean(axis=1) * normal) / 3 == pytest.approx(1.08 * H)  # outward: the volume is positive
        area = 2 * 1.08 + 2 * (1.2 + 0.9) * H
        assert np.linalg.norm(normal, axis=1).sum() == pytest.approx(area)
        sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        assert (np.unique(sides, axis=0, return_counts=True)[1] == 2).all()


@pytest.mark.parametrize("family", ["plate", "plate_bfs"])
@pytest.mark.parametrize(("angle", "turn"), [(None, random_rotation(5)), (1.2, random_rotation(5)), (1.2, np.eye(3))])
def test_the_skin_follows_rigid_motions(family, angle, turn):
    """Also of folded plates of which one lies in a plane of the axes, the other askew."""
    structure = flat(family, turn) if angle is None else plate_structure(bent(angle, 1, family, turn), H, family)
    for omega in turn.T[:2] if angle is None else np.eye(3):  # a flat plate's nodes do not turn about its normal
        d = displaced(
            structure,
            lambda x, w=omega: np.cross(w, x) + SHIFT,
            lambda x, w=omega: np.broadcast_to(w, x.shape),
        )
        moved = (structure.skin.operator @ d).reshape(-1, 3)
        assert moved == pytest.approx(np.cross(omega, structure.skin.points) + SHIFT, abs=1e-12)


@pytest.mark.parametrize("family", ["plate", "plate_bfs"])
def test_the_middles_of_sides_bend_with_the_plate(family):
    """w = x^2/2 + x y: the drawn points move by w, and by the slopes over half the thickness."""
    structure = flat(family, np.eye(3))

    def theta(x):
        return np.stack([x[:, 0], -(x[:, 0] + x[:, 1]), 0 * x[:, 0]], axis=1)

    d = displaced(structure, lambda x: np.outer(x[:, 0] ** 2 / 2 + x[:, 0] * x[:, 1], [0, 0, 1]), theta)
    x, y, z = structure.skin.points.T
    moved = (structure.skin.operator @ d).reshape(-1, 3)
    assert len(x) > 2 * len(structure.mesh.points)
    assert moved[:, 2] == pytest.approx(x**2 / 2 + x * y, abs=1e-12)
    assert moved[:, 0] == pytest.approx(-z * (x + y), abs=1e-12)
    assert moved[:, 1] == pytest.approx(-z * x, abs=1e-12)


def test_in_plane_bulges_of_sides_are_drawn():
    structure = plate_structure(rectangle(1.0, 1.0, 1, 1, CELL["plate"]), H)
    side = structure.inertia[0].dofs[0, 18:20]
    raw = np.zeros((structure.T.shape[0], 2))
    raw[side, [0, 1]] = 1.0
    moved = (structure.skin.operator @ (structure.T.T @ raw)).T.reshape(2, -1, 3)
    assert (np.abs(moved).sum(axis=2) > 0).sum(axis=1).tolist() == [2, 2]  # above and below one middle
    assert moved.max(axis=1) == pytest.approx(np.array([[1.0, 0, 0], [0, 1, 0]]), abs=1e-14)
