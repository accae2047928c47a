"""Rotations of sections, points with the mass of a body, and a body's summary."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.body.mass_points import points_of_moments


@pytest.mark.parametrize("seed", range(3))
def test_a_section_is_turned_by_its_slopes_and_then_its_twist(seed: int):
    """exp(p) exp(twist e) with the tangent exp(p) e: psi delta holds the twist and the sines of the slopes.

    Right to second order in all and to third in the slopes: p to 1e-2 and twist to 1e-4 leave 1e-9.
    """
    rng = np.random.default_rng(seed)
    frame = Rotation.random(random_state=seed).as_matrix()
    e, across = frame[:, 0], frame[:, 1:]
    slopes, twist = 0.02 * rng.uniform(0.3, 1.0, 2), 2e-4 * rng.uniform(0.5, 1.0)
    bent = across @ slopes
    wanted = (Rotation.from_rotvec(bent) * Rotation.from_rotvec(twist * e)).as_rotvec()
    size = np.linalg.norm(bent)
    s = twist * e + bent * np.sin(size) / size
    delta = rng.normal(size=4)
    psi = rng.normal(size=(3, 4))
    psi += np.outer(s - psi @ delta, delta) / (delta @ delta)
    marker = Marker(np.zeros(3), np.zeros((3, 4)), psi, axis=e)
    np.testing.assert_allclose(marker.rotation_vector(delta), wanted, atol=2e-8)
    assert np.abs(np.cross(e, bent)).max() * twist / 2 > 1e-7  # what second order adds
    assert size**3 / 6 > 1e-7  # and third
    many = marker.rotation_vector(np.stack([delta, 0 * delta]))
    np.testing.assert_allclose(many, [marker.rotation_vector(delta), np.zeros(3)], atol=1e-15)
    free = replace(marker, axis=np.zeros(3))
    np.testing.assert_allclose(free.rotation_vector(delta), s, atol=1e-15)


def test_six_points_have_the_mass_moments_of_a_body():
    c = np.array([0.4, -0.3, 1.2])
    body = rigid_body(3.0, np.array([[2.0, 0.1, -0.2], [0.1, 1.5, 0.05], [-0.2, 0.05, 1.8]]), c)
    rigid = body.moments
    first = np.vstack([rigid.first, [[0.6, 0.9, -0.3], [0.0, 1.2, 0.3]]])
    second = np.zeros((3, 3, 3, 3))
    second[0, :, 0] = rigid.second[0, :, 0]
    points = points_of_moments(MassMoments(3.0, first, second))
    assert points.dm.tolist() == [0.5] * 6 and points.phi.shape == (6, 3, 2)
    np.testing.assert_allclose(points.dm @ points.rho, first[0], atol=1e-14)
    np.testing.assert_allclose(np.einsum("p,pa,pb->ab", points.dm, points.rho, points.rho), second[0, :, 0], atol=1e-13)
    np.testing.assert_allclose(
        points.phi, np.broadcast_to([[0.2, 0.0], [0.3, 0.4], [-0.1, 0.1]], (6, 3, 2)), atol=1e-15
    )
    X = np.array([[2.0, 1.0, 0.0], [0.0, -1.0, 3.0]])
    np.testing.assert_allclose(points.mixed(X).phi[4], points.phi[4] @ X)
    np.testing.assert_allclose(points.over(np.array([1])).phi[2], [[0.0], [0.4], [0.1]], atol=1e-15)


def test_the_summary_of_a_body_counts_its_shapes_and_frequencies():
    n = 8
    first = np.zeros((1 + n, 3))
    first[0] = [3.0, -1.5, 0.75]
    moments = MassMoments(1.5, first, np.zeros((1 + n, 3, 1 + n, 3)))
    kinds = ("vibration",) * 6 + ("derivative", "vibration")
    omega = 2 * np.pi * np.array([1.25, 2.5, 3, 4, 5, 6, np.nan, 7.5])
    markers = {name: Marker.rigid(np.zeros(3), n_modes=n) for name in ("tip", "root")}
    body = FlexibleBody(moments, StrainTensors.linear(np.eye(n)), np.zeros((n, n)), markers, kinds=kinds, omega=omega)
    title, rows = body.summary()
    assert title == "Flexible body"
    assert dict(rows) == {
        "mass": "1.5 kg",
        "centre of mass": "(2, -1, 0.5) m",
        "coordinates": "8",
        "shapes": "7 vibration, 1 derivative",
        "strain": "linear",
        "frequencies": "1.25, 2.5, 3, 4, 5, 6 and 1 more Hz",
        "markers": "origin, root, tip",
    }
    assert repr(body).splitlines()[:2] == ["Flexible body", "  mass            1.5 kg"]
    title, rows = rigid_body(2.0, np.eye(3)).summary()
    assert title == "Rigid body" and [name for name, _ in rows] == ["mass", "centre of mass", "markers"]
