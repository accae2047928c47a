"""Shadow of parts of a craft on one another, against rays and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import femflex
from femflex import System, fem, rigid_body, simulate
from femflex.body import Marker, Skin
from femflex.effectors import Optical, SolarPressure, Sun, Surface
from femflex.mesh import rectangle
from femflex.reduction import cantilever_modes, reduce_structure
from femflex.system import free, weld, with_effectors

PRESSURE = 1361.0 / 299792458.0
CUBE = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]) / 2
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [2, 3, 7, 6], [1, 2, 6, 5], [0, 4, 7, 3]])


def skin_of(*quads) -> Skin:
    return Skin(
        np.concatenate(quads), {"quad": np.arange(4 * len(quads)).reshape(-1, 4)}, np.zeros((0, 4 * len(quads), 3))
    )


def box(size, centre):
    return [(CUBE * size + centre)[face] for face in FACES]


def flat(x0, x1, y0, y1, z0, z1=None):
    """A rectangle over x, y whose height goes from z0 to z1 along x."""
    z1 = z0 if z1 is None else z1
    return np.array([[x0, y0, z0], [x1, y0, z1], [x1, y1, z1], [x0, y1, z0]], float)


def first_rows(bodies, joints, nouns, direction, duration=1e-3, period=1.0, **options):
    nouns = {"sun": Sun(kind="sun", direction=direction), "light": SolarPressure(shadow_period=period)} | nouns
    return simulate(with_effectors(System(bodies, joints, **options), nouns), duration)


def rays(quads, s, optical, n=40000):
    """Force and torque about the origin per pressure by rays from n places of every rectangle, a Kronecker lattice."""
    across, up = (np.arange(n)[:, None] + 0.5) / n, np.arange(n)[:, None] * (np.sqrt(5) - 1) / 2 % 1.0
    wrench = np.zeros(6)
    for k, q in enumerate(quads):
        a, b = q[1] - q[0], q[3] - q[0]
        area = np.cross(a, b)
        c = area @ s / np.linalg.norm(area)
        if c <= 0.0:
            continue
        x = q[0] + across * a + up * b
        lit = np.ones(len(x), bool)
        for j, other in enumerate(quads):
            u, v = other[1] - other[0], other[3] - other[0]
            n_other = np.cross(u, v)
            if j == k or abs(n_other @ s) < 1e-12:
                continue
            along = (other[0] - x) @ n_other / (n_other @ s)
            hit = x + along[:, None] * s - other[0]
            e, f = hit @ u / (u @ u), hit @ v / (v @ v)
            lit &= ~((along > 1e-9) & (e > 0) & (e < 1) & (f > 0) & (f < 1))
        normal = area / np.linalg.norm(area)
        force = -c * ((1 - optical.specular) * s + 2 * (optical.specular * c + optical.diffuse / 3) * normal)
        force = force * np.linalg.norm(area) / n
        wrench += np.concatenate([lit.sum() * force, np.cross(x[lit].sum(axis=0), force)])
    return wrench


CRAFT = [*box([2, 2, 2.0], [0, 0, 0]), *box([4, 1.5, 0.05], [3.1, 0, 0.4]), *box([4, 1.5, 0.05], [-3.1, 0, 0.4])]


@pytest.mark.parametrize("direction", [(0.6, 0, 0.8), (-0.8, 0.1, 0.5), (0.9, 0.3, 0.2), (0.3, -0.7, -0.6), (0, 0, 1)])
def test_box_with_two_wings(direction):
    s = np.array(direction) / np.linalg.norm(direction)
    optical = Optical(specular=0.3, diffuse=0.2)
    body = rigid_body(100.0, np.diag([10.0, 12.0, 14.0]), skin=skin_of(*CRAFT))
    run = first_rows({"hub": body}, [free("hub")], {"skin": Surface(body="hub", front=optical)}, s)
    found = np.concatenate([run[f"effectors/light_hub/{key}"][-1] for key in ("force", "torque")]) / PRESSURE
    np.testing.assert_allclose(found, rays(CRAFT, s, optical), atol=1e-3)


PLATE = flat(0, 1, 0, 1, 0)


@pytest.mark.parametrize(
    ("shades", "direction", "lit", "centre"),
    [  # what is lit of the unit square at z = 0, and its centre
        ([flat(0.5, 2, 0.25, 2, 1)], (0, 0, 1), 0.625, (0.35, 0.425)),
        ([flat(0.5, 2, 0.25, 2, -1)], (0, 0, 1), 1.0, (0.5, 0.5)),  # behind it
        ([flat(0, 1, -1, 2, -1, 1)], (0, 0, 1), 0.5, (0.25, 0.5)),  # through its plane: only what is in front
        ([flat(0, 1, -1, 2, -1, 1)], (0.6, 0, 0.8), 0.75, (0.40625 / 0.75, 0.5)),
        ([flat(1, 2, 0, 1, 0), flat(0, 1, 1, 2, 0)], (0.6, 0, 0.8), 1.0, (0.5, 0.5)),  # neighbours in its plane
        ([np.array([[1, 0, 0], [1, 1, 0], [1, 1, 0.3], [1, 0, 0.3]])], (0.6, 0, 0.8), 0.775, (0.3875, 0.5)),  # a wall
        ([flat(0, 0.6, 0, 1, 1), flat(0.4, 1, 0, 0.5, 2)], (0, 0, 1), 0.2, (0.8, 0.75)),  # one over the other
    ],
)
def test_lit_part_of_a_plate(shades, direction, lit, centre):
    bodies = {"plate": rigid_body(1.0, np.eye(3), skin=skin_of(PLATE))}
    bodies["shade"] = rigid_body(1.0, np.eye(3), skin=skin_of(*shades))
    nouns = {name: Surface(body=name) for name in bodies} | {
        "light": SolarPressure(bodies=["plate"], shadow_period=1.0)
    }
    run = first_rows(bodies, [weld("plate"), weld("shade")], nouns, direction)
    s = np.array(direction)
    force, torque = (run[f"effectors/light_plate/{key}"][-1] / PRESSURE for key in ("force", "torque"))
    assert run["effectors/light_shadow/lit_plate"][-1] == pytest.approx(lit, abs=1e-6)
    np.testing.assert_allclose(force, -s[2] * lit * s, atol=1e-6)
    np.testing.assert_allclose(torque, np.cross([*centre, 0.0], -s[2] * lit * s), atol=1e-6)
