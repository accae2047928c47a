"""Strain fields with random tables: strains, energy, section forces and stresses against loops over points."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest

from femflex.body.recovery import resultants, von_mises
from femflex.body.strain_field import ARRAYS, StrainPart, read_field, write_field

S = {"line": 4, "plate": 8, "solid": 6}


def random_part(kind, points=6, n=3, gradients=9, per=1, common=False, nonlinear=True, seed=0, s=None):
    """A part with a table of its own at every point, or one for all of them (common)."""
    rng = np.random.default_rng([seed, len(kind), points, int(common)])
    s, k = s or S[kind], 1 if common else points
    elastic = rng.normal(size=(k, s, s))
    Q = rng.normal(size=(s, gradients, gradients))
    return StrainPart(
        kind=kind,
        places=rng.normal(size=(points, 3)),
        weight=rng.uniform(0.5, 2.0, points),
        rows=rng.normal(size=(points, gradients, n)).astype(np.float32),
        linear=rng.normal(size=(s, gradients)),
        quadratic=Q + Q.swapaxes(1, 2),
        elastic=elastic + elastic.swapaxes(1, 2) + 5 * np.eye(s),
        stress=rng.normal(size=(k, s)),
        first=rng.normal(size=(n, n)),
        nonlinear=nonlinear,
        per=per,
        lever=rng.uniform(0.5, 2.0, k),
        fibres=rng.uniform(0.5, 2.0, (k, 4)) if kind == "line" else np.zeros((0, 4)),
    )


def amplitudes(part, t=4, seed=5):
    return np.random.default_rng(seed).normal(size=(t, len(part.first)))


def strain_at(part, p, y):
    """(linear, quadratic) strain of one point: products of two gradients of second order are left out."""
    g = part.rows[p].astype(float) @ y
    g1 = part.rows[p].astype(float) @ (part.first @ y)
    g2 = g - g1
    quadratic = np.array([g1 @ Q @ g1 / 2 + g1 @ Q @ g2 for Q in part.quadratic])
    return part.linear @ g, quadratic


@pytest.mark.parametrize("common", [False, True])
@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("kind", ["line", "plate", "solid"])
def test_strains_energy_and_resultants_of_each_point(kind, nonlinear, common):
    part = random_part(kind, common=common, nonlinear=nonlinear)
    y = amplitudes(part)
    eps, energy, forces = part.strains(y), part.energy(y), resultants(part, y)
    for i, row in enumerate(y):
        for p in range(len(part.places)):
            linear, quadratic = strain_at(part, p, row)
            k = 0 if common else p
            own = linear + quadratic if nonlinear else linear
            np.testing.assert_allclose(eps[i, p], own, rtol=1e-10, atol=1e-10)
            stored = own @ part.elastic[k] @ own / 2 + part.stress[k] @ (linear + quadratic)
            assert energy[i, p] == pytest.approx(stored, rel=1e-9, abs=1e-9)
            sigma = part.elastic[k] @ own + part.stress[k]
            if kind == "line":
                sigma[3] *= part.lever[k]
            np.testing.assert_allclose(forces[i, p], sigma, rtol=1e-9, atol=1e-9)


def equivalent(stress):
    """Von Mises' stress of a tensor (3, 3) by its principal values."""
    a, b, c = np.linalg.eigvalsh(stress)
    return np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2)


def test_von_mises_of_solids_by_principal_stresses():
    part = random_part("solid")
    y = amplitudes(part)
    found, forces = von_mises(part, y), resultants(part, y)
    for i in range(len(y)):
        for p in range(len(part.places)):
            xx, yy, zz, yz, xz, xy = forces[i, p]
            assert found[i, p] == pytest.approx(equivalent(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])))


@pytest.mark.parametrize("common", [False, True])
def test_von_mises_of_a_sheet_is_the_larger_of_its_two_faces(common):
    part = random_part("plate", common=common)
    elastic = part.elastic.copy()
    h = 2 * part.lever
    elastic[:, 3, 3] = elastic[:, 0, 0] * h**2 / 12
    part = replace(part, elastic=elastic)
    y = amplitudes(part, t=6)
    found, forces, upper = von_mises(part, y), resultants(part, y), 0
    for i in range(len(y)):
        for p in range(len(part.places)):
            t = h[0 if common else p]
            n, m = forces[i, p, :3], forces[i, p, 3:6]
            faces = []
            for z in (t / 2, -t / 2):
                xx, yy, xy = n / t + 12 * z / t**3 * m
                faces.append(equivalent(np.array([[xx, xy, 0], [xy, yy, 0], [0, 0, 0]])))
            upper += faces[0] > faces[1]
            assert found[i, p] == pytest.approx(max(faces))
    assert 0 < upper < len(y) * len(part.places)


def test_strain_field_survives_a_file(tmp_path):
    field = [random_part("line", per=3, seed=k, points=6 + 3 * k, common=k % 2 == 0) for k in range(11)]
    field.append(random_part("plate", nonlinear=False))
    with h5py.File(tmp_path / "field.h5", "w") as file:
        write_field(file, field)
        again = read_field(file)
        stored = file["strain_field/2"]
        for name, (description, units) in ARRAYS.items():
            assert stored[name].attrs["description"] == description and stored[name].attrs["units"] == units
    assert len(again) == len(field)
    for one, other in zip(field, again, strict=True):
        assert (one.kind, one.nonlinear, one.per) == (other.kind, other.nonlinear, other.per)
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
