"""Strain parts with random tables: strains, energy, section forces and stresses against loops and principal values."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest

from femflex.body import recovery
from femflex.body.recovery import (
    NearestPoint,
    at_points,
    fibre_stress,
    named,
    over_time,
    peaks,
    quantities,
    resultants,
    von_mises,
)
from femflex.body.strain_field import ARRAYS, NAMES, StrainPart, read_field, write_field

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
def test_strains_energy_and_resultants_are_those_of_each_point_alone(kind, nonlinear, common):
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


def test_elastic_matrices_need_not_be_symmetric_to_give_the_row_sums():
    """sigma_s = C_st eps_t, the second index with the strain."""
    for common in (False, True):
        part = random_part("solid", common=common)
        part = replace(part, elastic=np.random.default_rng(2).normal(size=part.elastic.shape))
        y = amplitudes(part)
        C = np.broadcast_to(part.elastic, (6, 6, 6))
        expected = [[C[p] @ part.strains(y)[i, p] + np.broadcast_to(part.stress, (6, 6))[p] for p in range(6)]
                    for i in range(4)]  # fmt: skip
        np.testing.assert_allclose(resultants(part, y), expected, rtol=1e-10, atol=1e-10)


def equivalent(stress):
    """Von Mises' stress of a tensor (3, 3) by its principal values."""
    a, b, c = np.linalg.eigvalsh(stress)
    return np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2)


def test_von_mises_of_solids_is_that_of_the_principal_stresses():
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


def test_sheets_of_which_one_point_is_a_laminate_have_no_stress_of_one_sheet():
    part = random_part("plate")
    elastic = part.elastic.copy()
    elastic[:, 3, 3] = elastic[:, 0, 0] * (2 * part.lever) ** 2 / 12
    assert "von_mises" in quantities([replace(part, elastic=elastic)])
    elastic[4, 3, 3] *= 1.01
    assert "von_mises" not in quantities([replace(part, elastic=elastic)])
    elastic[4, 3, 3] /= 1.01
    lever = part.lever.copy()
    lever[2] *= -1.0  # as good as none
    assert "von_mises" not in quantities([replace(part, elastic=elastic, lever=lever)])


@pytest.mark.parametrize("common", [False, True])
def test_fibre_stresses_of_a_line_take_each_point_s_own_section(common):
    part = random_part("line", common=common)
    y = amplitudes(part)
    forces, stress, mises = resultants(part, y), fibre_stress(part, y), von_mises(part, y)
    open_ = replace(part, fibres=np.where(np.arange(4) == 3, np.nan, part.fibres))  # a corner's stress
    corner = fibre_stress(open_, y)
    for i in range(len(y)):
        for p in range(len(part.places)):
            f = part.fibres[0 if common else p]
            N, Mz, My, T = np.abs(forces[i, p]) * f
            assert stress[i, p] == pytest.approx(N + np.sqrt(Mz**2 + My**2))
            assert mises[i, p] == pytest.approx(np.sqrt(stress[i, p] ** 2 + 3 * T**2))
            assert corner[i, p] == pytest.approx(N + Mz + My)
    assert "von_mises" in quantities([part]) and "von_mises" not in quantities([open_])


def test_one_open_section_among_round_ones_leaves_the_part_without_equivalent_stress():
    part = random_part("line")
    fibres = part.fibres.copy()
    fibres[3, 3] = np.nan
    mixed = replace(part, fibres=fibres)
    assert "von_mises" not in quantities([mixed]) and von_mises(mixed, amplitudes(part)) is None
    y = amplitudes(part)
    expected = np.abs(resultants(part, y)) * part.fibres
    assert fibre_stress(mixed, y)[1, 3] == pytest.approx(expected[1, 3, :3].sum())
    assert fibre_stress(mixed, y)[1, 2] == pytest.approx(expected[1, 2, 0] + np.hypot(*expected[1, 2, 1:3]))


def moment_line(per=4, elements=3):
    """Elements along skew lines of unequal lengths, their points unevenly spaced, moments polynomials of degree 3."""
    rng = np.random.default_rng(11)
    s = np.concatenate([[0.0], np.sort(rng.uniform(0.2, 0.8, per - 2)), [1.0]])
    places, along = [], []
    for e in range(elements):
        way = rng.normal(size=3) * (1 + e)
        places.append(rng.normal(size=3) + s[:, None] * way)
        along.append(s * np.linalg.norm(way))
    moment = rng.normal(size=(2, elements, per))  # cubic coefficients of M_z and M_y of each element
    M = np.array([[np.polynomial.Polynomial(moment[a, e])(along[e]) for e in range(elements)] for a in range(2)])
    V = np.array(
        [[np.polynomial.Polynomial(moment[a, e]).deriv()(along[e]) for e in range(elements)] for a in range(2)]
    )
    p = per * elements
    rows = np.zeros((p, 4, 1), np.float32)
    stress = np.zeros((p, 4))
    stress[:, 1], stress[:, 2] = M[0].ravel(), M[1].ravel()
    part = StrainPart("line", np.concatenate(places), np.ones(p), rows, np.eye(4), np.zeros((4, 4, 4)),
                      np.eye(4)[None], stress, np.eye(1), False, per)  # fmt: skip
    return part, V.reshape(2, p)


def test_shear_forces_are_the_slopes_of_the_moments_along_each_element():
    part, V = moment_line()
    y = np.zeros((2, 1))
    np.testing.assert_allclose(named(part, "shear_force_y", y), [-V[0]] * 2, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(named(part, "shear_force_z", y), [V[1]] * 2, rtol=1e-6, atol=1e-6)
    assert quantities([part]) == dict(zip(
        ("axial_force", "moment_z", "moment_y", "torque", "shear_force_y", "shear_force_z"),
        ("N", "N m", "N m", "N m", "N", "N"), strict=True,
    ))  # fmt: skip
    assert named(part, "fibre_stress", y) is None and named(part, "xx", y) is None


def test_units_of_plates_and_solids():
    assert quantities([random_part("plate")]) == {
        "force_xx": "N/m", "force_yy": "N/m", "force_xy": "N/m", "moment_xx": "N", "moment_yy": "N", "moment_xy": "N",
        "shear_x": "N/m", "shear_y": "N/m",
    }  # fmt: skip
    thin = replace(random_part("plate", s=6))
    assert list(quantities([thin])) == ["force_xx", "force_yy", "force_xy", "moment_xx", "moment_yy", "moment_xy"]
    assert named(thin, "shear_x", amplitudes(thin)) is None
    assert set(quantities([random_part("solid")]).values()) == {"Pa"} and len(quantities([random_part("solid")])) == 7
    assert random_part("plate", s=6).names == NAMES["plate"][:6]


@pytest.mark.parametrize("kind", ["line", "plate", "solid"])
def test_a_part_over_other_shapes_has_the_strains_of_the_mixture(kind):
    part = random_part(kind, n=4)
    rng = np.random.default_rng(3)
    X = rng.normal(size=(4, 4))
    first = np.linalg.solve(X, part.first @ X)
    z = rng.normal(size=(3, 4))
    mixed = part.mixed(X, first)
    np.testing.assert_allclose(mixed.strains(z), part.strains(z @ X.T), rtol=1e-4, atol=1e-4)
    shapes = np.array([2, 0])
    y = np.zeros((3, 4))
    y[:, shapes] = z[:, :2]
    block = replace(part, first=np.diag([1.0, 0.3, 0.6, 0.2]))
    np.testing.assert_allclose(block.over(shapes).strains(z[:, :2]), block.strains(y), rtol=1e-10, atol=1e-10)


def straight_line(common=False):
    """Two elements of three points each on a broken line, tables linear along each."""
    part = random_part("line", points=6, per=3, common=common, nonlinear=False)
    places = np.array([[0.1, 0, 0], [0.5, 0, 0], [0.9, 0, 0], [1.0, 0.2, 0], [1.0, 1.0, 0], [1.0, 1.8, 0]])
    return replace(part, places=places)


@pytest.mark.parametrize(
    ("point", "k", "j", "share"),
    [
        ([0.4, 0.3, 0.1], 1, 0, 0.25),  # nearest 0.5, then 0.1; off the line
        ([0.6, -0.2, 0.0], 1, 2, 0.25),
        ([0.05, 0.0, 0.0], 0, 1, -0.125),  # beyond the first point
        ([-2.0, 0.0, 0.0], 0, 1, -0.5),  # at most half a distance beyond
        ([1.3, 1.3, 0.0], 4, 5, 0.375),
        ([1.0, 1.9, 0.2], 5, 4, -0.125),
        ([1.0, 0.15, 0.0], 3, 4, -0.0625),  # the neighbour of its own element, though another one is nearer
    ],
)
@pytest.mark.parametrize("common", [False, True])
def test_gradients_at_a_place_are_linear_between_the_two_nearest_points_of_an_element(point, k, j, share, common):
    part = straight_line(common)
    found, y = part.at(np.array(point)), amplitudes(part)

    def between(table):
        return table if len(table) == 1 else ((1 - share) * table[k] + share * table[j])[None]

    for name in ("places", "weight", "elastic", "stress", "lever", "fibres"):
        np.testing.assert_allclose(getattr(found, name), between(getattr(part, name)), rtol=1e-12, err_msg=name)
    np.testing.assert_allclose(found.strains(y), between(part.strains(y).swapaxes(0, 1)).swapaxes(0, 1), rtol=1e-5)
    assert found.per == 1 and found.rows.dtype == np.float32


@pytest.mark.parametrize("kind", ["plate", "solid"])
def test_sheets_and_solids_have_the_gradients_of_the_nearest_point(kind):
    part = random_part(kind, per=3)
    point = part.places[4] + 0.01
    found = part.at(point)
    np.testing.assert_array_equal(found.places, part.places[4:5])
    np.testing.assert_array_equal(found.rows, part.rows[4:5])
    np.testing.assert_array_equal(found.elastic, part.elastic[4:5])


def test_peaks_are_the_largest_magnitudes_of_all_parts_of_a_kind():
    """Of two lines, a sheet and a solid; largest values of either sign, each with its own time and place."""
    parts = [
        random_part("solid", seed=4),
        random_part("plate", seed=6),
        random_part("line", per=3, seed=1),
        random_part("line", per=3, seed=2),
    ]
    parts[3] = replace(parts[3], elastic=-parts[3].elastic, stress=-parts[3].stress)
    time = np.array([0.5, 1.25, 3.0, 7.0, 7.5])
    y = amplitudes(parts[0], t=5)
    found = peaks(parts, y, time)
    assert [(peak.kind, peak.name) for peak in found] == [
        *(("line", name) for name in sorted(quantities(parts[2:]))),
        *(("plate", name) for name in sorted(quantities(parts[1:2]))),
        *(("solid", name) for name in sorted(quantities(parts[:1]))),
    ]
    for peak in found:
        own = [part for part in parts if part.kind == peak.kind]
        values = [np.abs(named(part, peak.name, y)) for part in own]
        k = int(np.argmax([value.max() for value in values]))
        t, p = np.unravel_index(values[k].argmax(), values[k].shape)
        assert peak.value == pytest.approx(values[k].max(), rel=1e-12)
        assert peak.time == time[t] and peak.place == tuple(own[k].places[p])
        assert peak.unit == quantities(own)[peak.name]


def test_largest_values_found_in_chunks_of_time_are_those_of_the_whole(monkeypatch):
    part = random_part("line", points=6, per=3)
    y = amplitudes(part, t=23)
    whole = over_time(part, y, ["torque", "shear_force_z"])
    monkeypatch.setattr(recovery, "CHUNK", 6 * 20 * 5)  # five rows at once
    rows = []
    count = recovery.named
    monkeypatch.setattr(recovery, "named", lambda part, name, y: (rows.append(len(y)), count(part, name, y))[1])
    chunks = over_time(part, y, ["torque", "shear_force_z"])
    assert max(rows) == 5
    for name in whole:
        every = np.abs(count(part, name, y))
        np.testing.assert_allclose(whole[name][0], every.max(axis=0))
        np.testing.assert_array_equal(whole[name][1], every.argmax(axis=0))
        np.testing.assert_allclose(chunks[name][0], whole[name][0])
        np.testing.assert_array_equal(chunks[name][1], whole[name][1])


@pytest.mark.parametrize("common", [False, True])
def test_a_quantity_at_a_place_is_that_of_the_nearest_point_of_the_parts_that_have_it(common):
    near = replace(random_part("solid", seed=1), places=np.zeros((6, 3)))
    parts = [near, *(random_part("line", per=3, common=common, seed=seed) for seed in (7, 8))]
    y, points = amplitudes(near), []
    expected, places = [], []
    for part, p in ((parts[2], 4), (parts[1], 2), (parts[2], 0)):
        points.append(part.places[p] + 1e-4)
        places.append(part.places[p])
        expected.append(named(part, "shear_force_y", y)[:, p])
    values, where = at_points(parts, "shear_force_y", points, y)
    np.testing.assert_allclose(values, np.transpose(expected), rtol=1e-9)
    np.testing.assert_array_equal(where, places)
    found = NearestPoint.of(parts, "torque", points[0])
    assert found.unit == "N m" and len(found.part.places) == 3
    np.testing.assert_array_equal(found.place, places[0])
    np.testing.assert_allclose(found.values(y), named(parts[2], "torque", y)[:, 4], rtol=1e-9)
    with pytest.raises(
        ValueError, match=r"quantity 'moment_xx' is not known of this body; it has xx, .*von_mises, axi"
    ):
        at_points(parts, "moment_xx", points, y)


def test_a_field_comes_back_from_a_file_part_by_part(tmp_path):
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


def test_fields_of_earlier_files_have_so_many_shapes_of_first_order_and_no_fibres(tmp_path):
    part = random_part("line", per=3)
    with h5py.File(tmp_path / "field.h5", "w") as file:
        assert read_field(file) == ()
        write_field(file, [part])
        own = file["strain_field/0"]
        for name in ("first", "lever", "fibres"):
            del own[name]
        del own.attrs["per"]
        own.attrs["leading"] = 2
        (again,) = read_field(file)
    np.testing.assert_array_equal(again.first, np.diag([1.0, 1.0, 0.0]))
    np.testing.assert_array_equal(again.lever, [0.0])
    assert again.per == 1 and again.fibres.shape == (0, 4)
